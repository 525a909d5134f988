#include "apps/brachy/offline/plan_report.h"

#include <nlohmann/json.hpp>

#include "apps/score/report_figures.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

bool is_missed(const PlanReport& report, const DoseFigure& f) {
  const double value = figure_of(report.dose, f);
  return std::isfinite(value) && !f.is_met_by(value, report.plan.prescription_gy);
}

std::string needle_lines(const PlanReport& r) {
  std::string text =
      fmt::format("  {:<6}{:>7}{:>12}   {}\n", "hole", "seeds", "retract, mm", "train from the tip");
  for (const PlanNeedle& n : r.plan.needles)
    text += fmt::format("  {:<6}{:>7}{:>12g}   {}\n", n.hole, n.seed_offsets_mm().size(), n.retraction_mm,
                        n.train);
  return text;
}

std::string dose_lines(const PlanReport& r) {
  std::string text;
  for (const DoseFigure& f : dose_figures()) {
    if (!std::isfinite(figure_of(r.dose, f))) continue;  // the scene has no such structure
    const std::string goal = goal_of(f, r.plan.prescription_gy);
    text +=
        fmt::format("  {:<22}{:>9}{}{}{}\n", fmt::format("{} {}, {}", f.structure, f.name, f.unit),
                    figure_in(r.dose, f), goal.empty() ? "" : "  ", goal, is_missed(r, f) ? "  MISSED" : "");
  }
  return text;
}

}  // namespace

std::string to_text(const PlanReport& r) {
  const Plan& p = r.plan;
  std::string notes;
  for (const std::string& note : r.notes) notes += "note: " + note + "\n";
  if (r.placed_seeds > 0)
    notes += fmt::format("with {} seeds in place; the figures are of these and the plan together\n",
                         r.placed_seeds);
  return fmt::format(
             "plan \"{}\": {} needles, {} seeds of {}, {:g} U each, {:.2f} U in all, {:.2f} of the "
             "customary; {:g} "
             "Gy\n",
             p.name, p.needles.size(), p.seed_count(), to_string(p.source), p.air_kerma_strength_u,
             r.total_u(), r.total_u() / r.customary_u, p.prescription_gy) +
         notes + needle_lines(r) + "dose, the gland at rest:\n" + dose_lines(r);
}

std::string to_json(const PlanReport& r) {
  const Plan& p = r.plan;
  nlohmann::ordered_json json = {{"name", p.name},
                                 {"source", to_string(p.source)},
                                 {"air_kerma_strength_u", p.air_kerma_strength_u},
                                 {"prescription_gy", p.prescription_gy},
                                 {"needle_count", p.needles.size()},
                                 {"seed_count", p.seed_count()},
                                 {"total_strength_u", r.total_u()},
                                 {"customary_strength_u", r.customary_u},
                                 {"placed_seed_count", r.placed_seeds},
                                 {"notes", r.notes}};
  for (std::size_t n = 0; n < p.needles.size(); ++n) {
    const Vec3 tip = p.planned_tip(r.grid, n);
    json["needles"].push_back({{"hole", p.needles[n].hole},
                               {"retraction_mm", p.needles[n].retraction_mm},
                               {"train", p.needles[n].train},
                               {"tip_mm", {tip.x(), tip.y(), tip.z()}}});
  }
  json["figures"] = nlohmann::ordered_json::array();
  for (const DoseFigure& f : dose_figures()) {
    const double value = figure_of(r.dose, f);
    if (!std::isfinite(value)) continue;
    nlohmann::ordered_json figure = {
        {"structure", f.structure}, {"name", f.name}, {"unit", f.unit}, {"value", value}};
    if (f.goal != DoseFigure::Goal::kNone) {
      figure[f.goal == DoseFigure::Goal::kAbove ? "above" : "below"] = f.limit_for(p.prescription_gy);
      figure["met"] = !is_missed(r, f);
    }
    json["figures"].push_back(figure);
  }
  return json.dump();
}

}  // namespace brachy
