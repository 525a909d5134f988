#include "apps/score/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "apps/score/recording.h"
#include "apps/session/plan_change_log.h"
#include "core/base/error.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

// The probe is no needle: it is in the rectum all the time.
void leave_out(Recording& recording, std::uint32_t probe) {
  std::erase_if(recording.forces, [&](const RecordedForce& row) { return row.needle == probe; });
  if (!recording.poses) return;
  std::vector<NeedleTrajectories::Needle> needles = recording.poses->needles();
  std::erase_if(needles, [&](const auto& needle) { return needle.id == probe; });
  std::optional<NeedleTrajectories> rest;
  if (!needles.empty()) rest = NeedleTrajectories(std::move(needles));
  recording.poses = std::move(rest);
}

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

}  // namespace

Score score_recording(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                      const std::vector<Structure>& structures,
                      const std::function<void(double share)>& progress) {
  Recording recording = load_recording(folder);
  note_plan_changes(recording, load_plan_changes(SessionFolder::open(folder)), plan.seed_count());
  if (scene.probe.on) leave_out(recording, static_cast<std::uint32_t>(scene.needle.count));
  return score_session(plan, scene.template_grid, structures, scene.dose, recording, progress,
                       scene.goals.empty() ? default_dose_goals() : scene.goals);
}

Report make_report(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                   const std::function<void(double share)>& progress,
                   const std::vector<std::string>& remarks) {
  const std::vector<Structure> structures = load_structures(scene);
  Report report{score_recording(folder, plan, scene, structures, progress), {}, {}};
  report.score.remarks.insert(report.score.remarks.begin(), remarks.begin(), remarks.end());
  report.html = to_html(report.score, plan, scene.template_grid, structures);
  report.json = to_json(report.score) + "\n";
  return report;
}

void keep_report(const SessionFolder& folder, const char* name, const std::string& text,
                 EarlierReport earlier) {
  const std::optional<std::string> before = folder.read(name);
  if (before == text) return;
  if (before && earlier == EarlierReport::kRefused)
    throw UserError(
        folder.path_of(name).string() +
        ": exists already, and says something else; --out writes elsewhere, --force overwrites it");
  folder.replace(name, text);
}

void keep_report(const SessionFolder& folder, const Report& report, EarlierReport earlier) {
  // Both are judged before one is written.
  for (const auto& [name, text] :
       {std::pair(kReportPage, &report.html), std::pair(kReportJson, &report.json)})
    if (earlier == EarlierReport::kRefused && folder.read(name).value_or(*text) != *text)
      keep_report(folder, name, *text, earlier);
  keep_report(folder, kReportPage, report.html, earlier);
  keep_report(folder, kReportJson, report.json, earlier);
}

}  // namespace brachy
