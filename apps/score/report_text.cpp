#include <fmt/format.h>

#include <algorithm>

#include "apps/score/report.h"
#include "apps/score/report_figures.h"
#include "apps/score/report_sections.h"

namespace brachy {
namespace {

std::string error_line(const char* when, const MisplacementSpread& s) {
  return fmt::format("  {:<22}{:>8}{:>8}{:>8}{:>9}{:>9}{:>9}\n", when, figure(s.total_mm.mean, 2),
                     figure(s.total_mm.sd, 2), figure(s.total_mm.max, 2), figure(s.axial_mm.mean, 2),
                     figure(s.lateral_mm.mean, 2), figure(100 * s.axial_share, 0));
}

std::string seed_lines(const Score& score) {
  if (const std::string without = seeds_without_plan(score); !without.empty())
    return "seeds: " + without + "\n";
  if (!score.seeds) return fmt::format("seeds: {} planned, not known what fell\n", score.planned_seeds);
  const SeedsScore& s = *score.seeds;
  return fmt::format("seeds: {}\n", headline(s)) +
         fmt::format("  {:<22}{:>8}{:>8}{:>8}{:>9}{:>9}{:>9}\n", "error, mm", "mean", "SD", "max", "axial",
                     "lateral", "axial, %") +
         error_line("where they fell", s.by_position.dropped) +
         error_line("after relaxation", s.by_position.rest) +
         fmt::format("  {:<22}{:>8}{:>8}{:>8}\n", "gland motion", figure(s.gland_motion_mm.mean, 2),
                     figure(s.gland_motion_mm.sd, 2), figure(s.gland_motion_mm.max, 2));
}

std::string finding_lines(const Score& score) {
  std::string text;
  for (std::size_t i = 0; i < std::min(score.findings.size(), kTopFindings); ++i)
    text += fmt::format("{}. {}\n", i + 1, score.findings[i].text);
  return score.unexplained ? text + unexplained_text(score) + "\n" : text;
}

std::string needle_line(const NeedlesScore& n) {
  const auto of = [&](double NeedleMetrics::*value, int digits) {
    return n.motion ? figure((*n.motion).*value, digits) : "–";
  };
  return fmt::format(
      "needles: {} s, {} mm of path, {} mm and {} s in tissue, {} passes, {} punctures, at most {} N\n",
      of(&NeedleMetrics::elapsed_time_s, 1), of(&NeedleMetrics::path_length_mm, 0),
      of(&NeedleMetrics::path_in_tissue_mm, 0), of(&NeedleMetrics::time_in_tissue_s, 1),
      n.motion ? std::to_string(n.motion->passes) : "–", figure(n.punctures), figure(n.largest_force_n, 2));
}

std::string dose_lines(const DoseScore& dose) {
  std::string text = fmt::format("dose, {:g} Gy:\n  {:<22}{:>9}{:>12}{:>18}\n", dose.prescription_gy, "",
                                 "planned", "as dropped", "after relaxation");
  for (const DoseFigure& f : dose_figures())
    text += fmt::format("  {:<22}{:>9}{:>12}{:>18}\n", fmt::format("{} {}, {}", f.structure, f.name, f.unit),
                        figure_in(dose.plan, f), figure_in(dose.dropped, f), figure_in(dose.rest, f));
  return text;
}

}  // namespace

std::string to_text(const Score& score) {
  return fmt::format("{}, plan \"{}\"\n", score.recording, score.plan) + finding_lines(score) +
         seed_lines(score) + needle_line(score.needles) + study_lines(score) + dose_lines(score.dose) +
         (score.goals.empty() ? "" : "verdict: " + verdict(score.goals) + "\n") + kNotice + "\n";
}

}  // namespace brachy
