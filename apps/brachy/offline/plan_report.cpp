#include "apps/brachy/offline/plan_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/score/report_figures.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

/// A line of the report: a figure that is always shown, or that a goal asks for.
struct FigureRow {
  std::string structure, name, unit;
  double value;
  std::optional<GoalResult> goal;
};

/// The figures whose structure the scene has.
std::vector<FigureRow> figure_rows(const PlanReport& r) {
  std::vector<GoalResult> goals;
  for (const GoalResult& result : judge(r.goals, {r.plan.prescription_gy, 0, r.dose, {}, {}, {}}))
    if (result.goal.is_of_plan() && result.is_met) goals.push_back(result);
  std::vector<FigureRow> rows;
  for (const DoseFigure& f : dose_figures()) {
    const double value = figure_of(r.dose, f);
    if (!std::isfinite(value)) continue;
    const auto found = std::ranges::find_if(goals, [&](const GoalResult& result) {
      return result.goal.structure == f.structure && find_dose_index(result.goal.figure)->value == f.value;
    });
    FigureRow row{f.structure, f.name, f.unit, value, {}};
    if (found != goals.end()) {
      row.goal = *found;
      goals.erase(found);
    }
    rows.push_back(std::move(row));
  }
  for (const GoalResult& result : goals)
    rows.push_back({result.goal.structure, result.goal.figure,
                    unit_text(find_dose_index(result.goal.figure)->unit), result.value, result});
  return rows;
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
  for (const FigureRow& row : figure_rows(r)) {
    std::string goal;
    if (row.goal)
      goal = fmt::format("  {} {:.4g}{}", row.goal->goal.is_above() ? "≥" : "<", row.goal->limit,
                         *row.goal->is_met ? "" : "  MISSED");
    text += fmt::format("  {:<22}{:>9}{}\n", fmt::format("{} {}, {}", row.structure, row.name, row.unit),
                        figure(row.value, row.unit == "cm³" ? 2 : 1), goal);
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
  for (const FigureRow& row : figure_rows(r)) {
    nlohmann::ordered_json figure = {
        {"structure", row.structure}, {"name", row.name}, {"unit", row.unit}, {"value", row.value}};
    if (row.goal) {
      figure[row.goal->goal.side] = row.goal->limit;
      figure["met"] = *row.goal->is_met;
    }
    json["figures"].push_back(figure);
  }
  return json.dump();
}

}  // namespace brachy
