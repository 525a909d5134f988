#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/recording/recording_file.h"
#include "apps/score/class_table.h"
#include "apps/score/exercise.h"
#include "apps/score/hdr_report.h"
#include "apps/score/history.h"
#include "apps/score/report.h"
#include "apps/score/report_page.h"
#include "apps/session/session_manifest.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/base/version.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"

namespace brachy {
namespace {

struct ScoreOptions {
  std::optional<std::filesystem::path> recording;  ///< directory, or a file of seeds
  std::optional<std::filesystem::path> exercise;   ///< none: nothing is to be passed
  std::optional<std::filesystem::path> history, instructor, cohort, csv;
  std::optional<std::filesystem::path> of_class;      ///< directory
  std::string trainee;                                ///< whose sheet of the class's page; empty: all
  std::optional<std::filesystem::path> plan, config;  ///< none: the session's own
  std::optional<std::filesystem::path> out;           ///< none: report.html in the recording
  bool json = false, force = false, what_if = false;
};

/// What a session is scored in and against.
struct Scoring {
  Scene scene;
  std::optional<SessionManifest> manifest;  ///< the session's; nullopt: of before there were any
  std::vector<std::string> remarks;         ///< for the report
  std::string note;                         ///< for standard error alone; empty: none
};

std::string name_of(const std::optional<std::filesystem::path>& scene) {
  return scene ? scene->string() : "the built-in phantom";
}

/// Refuses a session that is none of the exercise, which only its own scene, plan and goals are.
void require_exercise(const Scoring& scoring, const Exercise& exercise, const ScoreOptions& options) {
  const auto differences =
      differences_from(*scoring.manifest, load_scene(exercise.scene), ManifestScope::kJudged);
  if (differences.empty()) return;
  const std::string own =
      scoring.manifest->exercise
          ? "exercise \"" + exercise_name_in(scoring.manifest->exercise->text) + "\""
          : "the scene " + name_of(scoring.manifest->scene.file.empty()
                                       ? std::nullopt
                                       : std::optional<std::filesystem::path>(scoring.manifest->scene.file));
  throw UserError(options.recording->string() + ": is a session of " + own + ", not of exercise \"" +
                  exercise.name + "\": " + listed_differences(differences) +
                  "; give its own exercise, or none");
}

bool is_of_seeds_alone(const ScoreOptions& options) {
  return std::filesystem::is_regular_file(*options.recording);
}

Scoring load_scoring(const ScoreOptions& options, const std::optional<Exercise>& exercise) {
  Scoring scoring;
  const std::string session = options.recording->string();
  if (is_of_seeds_alone(options)) {
    scoring.scene = load_scene_for(*options.recording, options.config, options.what_if).scene;
    return scoring;
  }
  scoring.manifest = load_manifest(SessionFolder::open(*options.recording));
  const std::optional<std::filesystem::path> config = options.config ? options.config
                                                      : exercise     ? std::optional(exercise->scene)
                                                                     : std::nullopt;
  if (!scoring.manifest) {
    if (config) scoring.scene = load_scene(*config);
    scoring.note =
        session +
        ": has no session.json, as recordings and sessions of earlier versions: it is taken as one of " +
        name_of(config);
    return scoring;
  }
  if (exercise) require_exercise(scoring, *exercise, options);
  if (!options.config) {
    scoring.scene = exercise ? load_scene(exercise->scene) : scene_of(*scoring.manifest, session);
    return scoring;
  }
  scoring.scene = load_scene(*options.config);
  const auto differences = differences_from(*scoring.manifest, scoring.scene,
                                            exercise ? ManifestScope::kJudged : ManifestScope::kRecorded);
  if (differences.empty()) return scoring;
  if (!options.what_if)
    throw UserError(session + ": is a session of another scene than " + options.config->string() + ": " +
                    listed_differences(differences) +
                    "; leave out --config for its own, or add --what-if and --out");
  scoring.remarks.push_back(
      "What if: scored in another scene than the session's own: " + listed_differences(differences) + ".");
  scoring.manifest.reset();
  return scoring;
}

std::string no_plan(const ScoreOptions& options) {
  return options.recording->string() +
         ": has no plan to score against; give it with --plan, or a scene that has plan.file with --config";
}

/// The needles of two plans are the same, whatever file they come from.
bool is_same_plan(Plan a, const Plan& b, const TemplateGrid& grid) {
  a.name = b.name;
  return to_csv(a, grid) == to_csv(b, grid);
}

/// The plan that was given, else the session's own; another than that only for what if.
template <class AnyPlan>
AnyPlan chosen_plan(const ScoreOptions& options, Scoring& scoring, const std::optional<AnyPlan>& given,
                    const std::optional<AnyPlan>& own, bool is_same) {
  if (!given && !own) throw UserError(no_plan(options));
  if (!given) return *own;
  if (own && !is_same) {
    if (!options.what_if)
      throw UserError(options.plan->string() + ": is not the plan of the session " +
                      options.recording->string() +
                      "; leave out --plan for its own, or add --what-if and --out");
    scoring.remarks.push_back("What if: scored against another plan than the session's own.");
  }
  return *given;
}

/// Of a file of seeds alone the plan may be empty.
Plan plan_of(const ScoreOptions& options, Scoring& scoring) {
  const Scene& scene = scoring.scene;
  std::optional<Plan> given, own;
  if (options.plan) given = load_plan(*options.plan, scene.template_grid, scene.needle.length_mm);
  if (scoring.manifest)
    own = plan_of(*scoring.manifest, scene);
  else if (!given)
    own = load_plan(scene);
  if (!given && !own && is_of_seeds_alone(options)) {
    Plan none;
    none.source = scene.seeds.source;
    none.prescription_gy = scene.dose.prescription_gy;
    return none;
  }
  return chosen_plan(options, scoring, given, own,
                     given && own && is_same_plan(*given, *own, scene.template_grid));
}

HdrPlan hdr_plan_of(const ScoreOptions& options, Scoring& scoring) {
  const Scene& scene = scoring.scene;
  std::optional<HdrPlan> given, own;
  if (options.plan) given = load_hdr_plan(*options.plan, scene.template_grid, scene.needle.length_mm);
  if (scoring.manifest)
    own = hdr_plan_of(*scoring.manifest, scene);
  else if (!given)
    own = load_hdr_plan(scene);
  return chosen_plan(options, scoring, given, own, given == own);
}

/// The JSON beside --out.
std::optional<std::filesystem::path> json_beside(const ScoreOptions& options) {
  if (!options.out) return std::nullopt;
  if (options.out->extension() == ".json")
    throw UserError(options.out->string() +
                    ": is the name of the JSON file; give the page another name, such as report.html");
  return std::filesystem::path(*options.out).replace_extension(".json");
}

void print_remarks(const History& history) {
  for (const std::string& remark : history.remarks) std::cerr << "brachy: " << remark << "\n";
}

int show_history(const ScoreOptions& options) {
  if (options.out)
    throw UsageError("--out is a session's or a class's page: give --csv, or --class for --history");
  const History trainee = load_history(*options.history);
  std::optional<History> instructor, cohort;
  if (options.instructor) instructor = load_history(*options.instructor);
  if (options.cohort) cohort = load_class(*options.cohort);
  print_remarks(trainee);
  if (options.csv) write_text(*options.csv, to_csv(trainee), options.force);
  std::cout << to_text(trainee, {instructor ? &*instructor : nullptr, cohort ? &*cohort : nullptr});
  return kExitOk;
}

int show_class(const ScoreOptions& options) {
  const History sessions = load_class(*options.of_class);
  print_remarks(sessions);
  const std::vector<TraineeTask> table = class_table(sessions);
  if (options.csv) write_text(*options.csv, to_csv(table), options.force);
  if (options.out) write_text(*options.out, to_html(sessions, options.trainee, version()), options.force);
  std::cout << to_text(table);
  return kExitOk;
}

SessionFolder folder_to_write(const std::filesystem::path& recording) {
  try {
    return SessionFolder::make(recording);
  } catch (const UserError& e) {
    throw UserError(std::string(e.what()) + ", or write the page elsewhere with --out");
  }
}

/// Whether two reports say the same but for whether an exercise is passed.
bool are_same_but_for_exercise(const std::string& a, const std::string& b) {
  nlohmann::json one = nlohmann::json::parse(a, nullptr, false),
                 other = nlohmann::json::parse(b, nullptr, false);
  if (!one.is_object() || !other.is_object()) return false;
  one.erase("exercise");
  other.erase("exercise");
  return one == other;
}

std::string without(std::string text, const std::string& part) {
  if (const std::size_t at = text.find(part); !part.empty() && at != std::string::npos)
    text.erase(at, part.size());
  return text;
}

/// A report as the tool writes and prints it.
struct Written {
  const Score& score;
  std::string text;
  const std::string &html, &json;
  const char* json_file;    ///< in the session's directory
  const std::string& note;  ///< Scoring::note
};

/// Writes a report into the session's directory. What is the same there already is not written, so that who may only
/// read the session can still score it. An exercise's result is added to a report that says nothing of one, and is not
/// taken out of a report that has one.
void keep(const Written& report, const SessionFolder& folder, bool force) {
  const std::optional<std::string> html = folder.read(kReportPage), json = folder.read(report.json_file);
  if (html == report.html && json == report.json) return;
  bool is_replaced = force;
  if (json && json != report.json && are_same_but_for_exercise(*json, report.json)) {
    if (!report.score.exercise && !force) return;
    is_replaced |= html == without(report.html, exercise_section(report.score));
  }
  keep_report(folder_to_write(folder.path()), {{kReportPage, report.html}, {report.json_file, report.json}},
              is_replaced ? EarlierReport::kReplaced : EarlierReport::kRefused);
}

int finish(const ScoreOptions& options, const std::optional<Exercise>& exercise, const Written& report) {
  const std::filesystem::path& recording = *options.recording;
  if (!report.note.empty()) std::cerr << "brachy: " << report.note << "\n";
  for (const std::string& remark : report.score.remarks) std::cerr << "brachy: " << remark << "\n";
  if (options.out) {
    write_text(*options.out, report.html, options.force);
    write_text(*json_beside(options), report.json, options.force);
  } else {
    keep(report, SessionFolder::open(recording), options.force);
  }
  if (options.json)
    std::cout << report.json;
  else
    std::cout << report.text << options.out.value_or(recording / kReportPage).string() << "\n";
  if (!exercise) return kExitOk;
  const ExerciseResult result = judge(*exercise, report.score);
  (options.json ? std::cerr : std::cout) << to_text(result);
  return result.has_passed() ? kExitOk : kExitFailed;
}

int run(const ScoreOptions& options) {
  if (options.of_class) return show_class(options);
  if (options.history) return show_history(options);
  if (!options.recording)
    throw UserError("give a recording to score, or --history or --class with a directory of scored sessions");
  const std::filesystem::path& recording = *options.recording;
  if (is_recording_file(recording))
    throw UserError(recording.string() +
                    ": is a recording in one file; write it into a folder with `brachy export " +
                    recording.string() + " --out DIR` and score that");
  check_output(json_beside(options), options.force);
  if (options.what_if && !options.out)
    throw UsageError(
        "--what-if scores against something else than the session's own: give the page a place with --out");
  std::optional<Exercise> exercise;
  if (options.exercise) exercise = load_exercise(*options.exercise);
  if (is_of_seeds_alone(options)) {
    if (!options.out)
      throw UsageError(recording.string() + ": is a file of seeds: give the page a place with --out");
    if (options.exercise)
      throw UsageError("an exercise is a session's, and " + recording.string() + " is a file of seeds");
  }
  if (exercise && options.what_if)
    throw UsageError("an exercise is passed in its own scene: leave out --what-if");
  Scoring scoring = load_scoring(options, exercise);
  if (scoring.scene.implant.is_hdr()) {
    if (is_of_seeds_alone(options))
      throw UserError(
          recording.string() +
          ": are seeds, and the scene's implant.kind is \"hdr\"; give a scene of seeds with --config");
    const HdrPlan plan = hdr_plan_of(options, scoring);
    const FractionReport report =
        make_fraction_report(recording, plan, scoring.scene, {scoring.remarks, exercise});
    return finish(options, exercise,
                  {report.score, to_text(report), report.html, report.json, kHdrReportFile, scoring.note});
  }
  const Plan plan = plan_of(options, scoring);
  Progress progress("score");
  const Report report = make_report(recording, plan, scoring.scene,
                                    [&](double share) { progress.show(share); }, {scoring.remarks, exercise});
  progress.finish();
  return finish(options, exercise,
                {report.score, to_text(report.score), report.html, report.json, kReportJson, scoring.note});
}

void declare(OptionList& list, ScoreOptions& options) {
  const Option recording =
      list.add("recording", options.recording,
               "directory of a session or of `brachy record`; or a file of seeds, as `brachy import` writes");
  list.add("--plan", options.plan, "TOML or CSV; default: the session's own, else the scene's");
  list.add(
      "--config", options.config,
      "the session's scene; default: its own, and of a recording that does not know it the built-in phantom");
  const Option out = list.add_output(
      "--out", options.out, "page to write, the JSON beside it; default: report.html in the recording");
  list.add(
      "--exercise", options.exercise,
      "config/exercises/….toml: whether the session passes, and why not; its scene is the default --config");
  const Option history =
      list.add("--history", options.history,
               "instead of a recording: the trend of all scored sessions in this directory");
  list.add("--instructor", options.instructor, "an instructor's sessions, to compare with").needs(history);
  list.add("--cohort", options.cohort,
           "a class's directory, whose other trainees' last sessions to compare with")
      .needs(history);
  const Option of_class =
      list.add("--class", options.of_class,
               "instead of a recording: trainees by exercises, of the sessions in this directory and in the "
               "trainees' directories in it; --out writes its page")
          .excludes(history)
          .excludes(recording);
  list.add("--trainee", options.trainee, "the page has the sheet of this one alone: a record of completion")
      .needs(of_class)
      .needs(out);
  list.add_output("--csv", options.csv,
                  "with --history a row for each session, with --class one for each trainee and exercise");
  list.add_flag("--what-if", options.what_if,
                "score against another scene or plan than the session's own, with --out");
  list.add_force(options.force);
  list.add_flag("--json", options.json, "print the whole report as JSON");
}

}  // namespace

Tool score_tool() {
  return make_tool<ScoreOptions>("score",
                                 "Score a recorded session against its plan; write report.html and .json.",
                                 R"(Examples:
  brachy score out/run1 --plan plan.toml
  brachy score out/run1 --plan plan.csv --config patient.toml --out run1.html --json
  brachy score out/run1 --exercise config/exercises/01_one_needle.toml
  brachy score patient/seeds.csv --config patient/scene.toml --out implant.html
  brachy score --history out/class/anna --instructor out/instructor --cohort out/class --csv anna.csv
  brachy score --class out/class --out class.html --csv class.csv
  brachy score --class out/class --trainee Anna --out anna.html
A session is scored in its own scene and against its own plan, which its session.json keeps; others are refused. A
report that is there already is kept: where it would change, --out or --force says what to do.
A recording is a directory with poses.csv, forces.csv and seeds.csv; missing or truncated files are reported,
and the rest is scored. Of a file of seeds (columns as for `brachy dose`, or a session's seeds.csv) the implant
alone is scored, against a plan where there is one, else its dose; seeds are compared with the planned ones that
they lie at. Per seed: error against plan, its part along the needle apart, where it was dropped and after
relaxation. Per needle: path and time in the prostate, passes, punctures, largest force. Dose of plan, of seeds
as dropped and after relaxation. A scene of implant.kind = "hdr": catheters.csv of the session against its plan,
and the dose as planned, as delivered and with times optimised again (hdr_report.json beside the page).
For training and research. Not a medical device.
Exit codes: 0 done, 1 the exercise is not passed, 2 bad input.)",
                                 declare, run);
}

}  // namespace brachy
