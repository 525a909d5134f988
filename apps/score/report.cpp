#include "apps/score/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "apps/score/recording.h"
#include "apps/session/plan_change_log.h"
#include "apps/session/session_manifest.h"
#include "core/base/error.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

/// Seeds of needles that changes of the plan added have numbers after those of the plan at the start.
void note_plan_changes(Recording& recording, const std::vector<PlanChange>& changes, std::size_t planned) {
  if (changes.empty()) return;
  if (recording.seeds)
    for (Seed& seed : *recording.seeds)
      if (seed.planned >= static_cast<std::int32_t>(planned)) seed.planned = Seed::kUnplanned;
  const std::string times = changes.size() == 1   ? "once"
                            : changes.size() == 2 ? "twice"
                                                  : std::to_string(changes.size()) + " times";
  const PlanChange& last = changes.back();
  recording.remarks.push_back(fmt::format(
      "The plan was changed {} while the session ran, last at {:.2f} s ({}); the score is against "
      "the one at its start, {} is the last one.",
      times, recording.clock.wall_s(last.t_s), last.what, last.file));
}

/// Before its own.
void add_remarks(const std::vector<std::string>& remarks, Score& score) {
  score.remarks.insert(score.remarks.begin(), remarks.begin(), remarks.end());
}

}  // namespace

Score score_recording(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                      const std::vector<Structure>& structures,
                      const std::function<void(double share)>& progress) {
  Recording recording;
  if (std::filesystem::is_directory(folder)) {
    recording = load_recording(folder);
    note_plan_changes(recording, load_plan_changes(SessionFolder::open(folder)), plan.seed_count());
  } else {
    recording = load_seeds_recording(folder);
  }
  if (scene.probe.on) leave_out(recording, static_cast<std::uint32_t>(scene.needle.count));
  return score_session(plan, scene.template_grid, structures, scene.dose, recording, progress,
                       scene.goals.empty() ? default_dose_goals() : scene.goals);
}

void add_session(const SessionFolder& folder, const ReportOptions& options, Score& score) {
  add_remarks(options.remarks, score);
  const std::optional<SessionManifest> manifest = load_manifest(folder);
  std::optional<Exercise> exercise = options.exercise;
  if (manifest) {
    score.about = {manifest->trainee, manifest->exercise ? exercise_name_in(manifest->exercise->text) : "",
                   manifest->runs.empty() ? "" : manifest->runs.front().began};
    try {
      if (manifest->exercise) exercise = exercise_in(manifest->exercise->text, manifest->exercise->file);
    } catch (const UserError& e) {
      score.remarks.push_back("Whether the exercise is passed is not known: " + std::string(e.what()));
    }
  }
  if (exercise) score.exercise = judge(*exercise, score);
}

Report make_report(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                   const std::function<void(double share)>& progress, const ReportOptions& options) {
  const std::vector<Structure> structures = load_structures(scene);
  Report report{score_recording(folder, plan, scene, structures, progress), {}, {}};
  if (std::filesystem::is_directory(folder))
    add_session(SessionFolder::open(folder), options, report.score);
  else
    add_remarks(options.remarks, report.score);
  report.html = to_html(report.score, plan, scene.template_grid, structures);
  report.json = to_json(report.score) + "\n";
  return report;
}

void keep_report(const SessionFolder& folder,
                 const std::vector<std::pair<const char*, const std::string&>>& files,
                 EarlierReport earlier) {
  // All are judged before one is written.
  std::vector<std::pair<const char*, const std::string&>> changed;
  for (const auto& [name, text] : files) {
    const std::optional<std::string> before = folder.read(name);
    if (before == text) continue;
    if (before && earlier == EarlierReport::kRefused)
      throw UserError(
          folder.path_of(name).string() +
          ": exists already, and says something else; --out writes elsewhere, --force overwrites it");
    changed.emplace_back(name, text);
  }
  for (const auto& [name, text] : changed) folder.replace(name, text);
}

void keep_report(const SessionFolder& folder, const Report& report, EarlierReport earlier) {
  keep_report(folder, {{kReportPage, report.html}, {kReportJson, report.json}}, earlier);
}

}  // namespace brachy
