#include <fstream>
#include <iostream>

#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/recording/recording_file.h"
#include "apps/score/exercise.h"
#include "apps/score/hdr_report.h"
#include "apps/score/history.h"
#include "apps/score/report.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"

namespace brachy {
namespace {

struct ScoreOptions {
  std::optional<std::filesystem::path> recording;  ///< directory
  std::optional<std::filesystem::path> exercise;   ///< none: nothing is to be passed
  std::optional<std::filesystem::path> history, instructor, csv;
  std::optional<std::filesystem::path> plan, config;  ///< none: the scene's plan; the built-in phantom
  std::optional<std::filesystem::path> out;           ///< none: report.html in the recording
  bool json = false, force = false;
};

Plan plan_of(const ScoreOptions& options, const Scene& scene) {
  if (options.plan) return load_plan(*options.plan, scene.template_grid, scene.needle.length_mm);
  if (const auto plan = load_plan(scene)) return *plan;
  throw UserError(options.recording->string() +
                  ": has no plan to score against; give it with --plan, or a scene that "
                  "has plan.file with --config");
}

std::filesystem::path page_of(const ScoreOptions& options) {
  const std::filesystem::path page = options.out.value_or(*options.recording / "report.html");
  if (page.extension() == ".json")
    throw UserError(page.string() +
                    ": is the name of the JSON file; give the page another name, such as report.html");
  return page;
}

int run_hdr(const ScoreOptions& options, const Scene& scene) {
  std::optional<HdrPlan> plan;
  if (options.plan) plan = load_hdr_plan(*options.plan, scene.template_grid, scene.needle.length_mm);
  const std::string report =
      score_catheters(*options.recording, scene, options.json, plan ? &*plan : nullptr);
  if (report.empty())
    throw UserError(options.recording->string() +
                    ": has no plan to score against; give it with --plan, or a scene that has plan.file");
  std::cout << report;
  return kExitOk;
}

int show_history(const ScoreOptions& options) {
  const History trainee = load_history(*options.history);
  std::optional<History> instructor;
  if (options.instructor) instructor = load_history(*options.instructor);
  for (const std::string& remark : trainee.remarks) std::cerr << "brachy: " << remark << "\n";
  if (options.csv) {
    check_folder_of(*options.csv);
    check_is_new(options.csv, options.force);
    std::ofstream out(*options.csv, std::ios::binary);
    out << to_csv(trainee);
    out.close();
    if (!out) throw UserError(options.csv->string() + ": cannot be written; check the free space");
  }
  std::cout << to_text(trainee, instructor ? &*instructor : nullptr);
  return kExitOk;
}

int run(const ScoreOptions& options) {
  if (options.history) return show_history(options);
  if (!options.recording)
    throw UserError("give a recording to score, or --history with a directory of scored sessions");
  const std::filesystem::path& recording = *options.recording;
  if (is_recording_file(recording))
    throw UserError(recording.string() +
                    ": is a recording in one file; write it into a folder with `brachy export " +
                    recording.string() + " --out DIR` and score that");
  const std::filesystem::path page = page_of(options);
  if (options.out) check_folder_of(page);
  std::optional<Exercise> exercise;
  if (options.exercise) exercise = load_exercise(*options.exercise);
  const Scene scene = options.config ? load_scene(*options.config)
                      : exercise     ? load_scene(exercise->scene)
                                     : Scene{};
  if (scene.implant.is_hdr()) return run_hdr(options, scene);
  Progress progress("score");
  const Score score = write_report(recording, plan_of(options, scene), scene, page,
                                   [&](double share) { progress.show(share); });
  progress.finish();
  for (const std::string& remark : score.remarks) std::cerr << "brachy: " << remark << "\n";
  if (options.json)
    std::cout << to_json(score) << "\n";
  else
    std::cout << to_text(score) << page.string() << "\n";
  if (!exercise) return kExitOk;
  const ExerciseResult result = judge(*exercise, score);
  (options.json ? std::cerr : std::cout) << to_text(*exercise, result);
  return result.has_passed() ? kExitOk : kExitFailed;
}

void declare(OptionList& list, ScoreOptions& options) {
  list.add("recording", options.recording, "directory of a session or of `brachy record`");
  list.add("--plan", options.plan, "TOML or CSV; default: the scene's");
  list.add("--config", options.config, "the session's scene; default: the built-in phantom");
  list.add("--out", options.out, "page to write, the JSON beside it; default: report.html in the recording");
  list.add(
      "--exercise", options.exercise,
      "config/exercises/….toml: whether the session passes, and why not; its scene is the default --config");
  list.add("--history", options.history,
           "instead of a recording: the trend of all scored sessions in this directory");
  list.add("--instructor", options.instructor, "with --history: an instructor's sessions, to compare with");
  list.add("--csv", options.csv, "with --history: file to write, a row for each session");
  list.add_flag("--force", options.force, "overwrite an existing --csv file");
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
  brachy score --history out/anna --instructor out/instructor --csv anna.csv
A recording is a directory with poses.csv, forces.csv and seeds.csv; missing or truncated files are reported,
and the rest is scored. Per seed: error against plan, its part along the needle apart, where it was dropped
and after relaxation. Per needle: path and time in the prostate, passes, punctures, largest force. Dose of
plan, of seeds as dropped and after relaxation. A scene of implant.kind = "hdr": catheters.csv of the session
against its plan, and the dose as planned, as delivered and with times optimised again (hdr_report.json). For
training and research. Not a medical device.
Exit codes: 0 done, 1 the exercise is not passed, 2 bad input.)",
                                 declare, run);
}

}  // namespace brachy
