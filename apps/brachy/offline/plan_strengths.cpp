#include "apps/brachy/offline/plan_strengths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/command_line/exit_code.h"
#include "apps/score/goal_results.h"
#include "apps/score/report_figures.h"
#include "apps/terminal/progress.h"
#include "core/base/number_text.h"

namespace brachy {
namespace {

/// The plan of one strength.
struct StrengthResult {
  double u = 0;
  std::string refusal;  ///< empty: there is a plan
  std::size_t needles = 0, seeds = 0;
  DoseStage dose;
  std::size_t goals = 0, met = 0;
};

StrengthResult plan_of(double u, const PlanRequest& request, const std::vector<Structure>& structures,
                       const Scene& scene) {
  StrengthResult result;
  result.u = u;
  try {
    const MadePlan made = make_plan(structures, scene.template_grid, request);
    result.needles = made.plan.needles.size();
    result.seeds = made.plan.seed_count();
    const DoseScore score = score_dose(made.plan, scene.template_grid, made.structures, scene.dose, nullptr);
    result.dose = score.plan;
    for (const GoalResult& goal :
         judge(request.goals.empty() ? default_dose_goals() : request.goals, score)) {
      if (!goal.goal.is_of_plan() || !goal.is_met) continue;
      ++result.goals;
      result.met += *goal.is_met;
    }
  } catch (const PlanRefused& e) {
    result.refusal = e.what();
  }
  return result;
}

void print_table(const std::vector<StrengthResult>& all) {
  std::cout << fmt::format("{:>6}{:>9}{:>7}{:>9}", "U", "needles", "seeds", "U in all");
  for (const DoseFigure& f : dose_figures())
    std::cout << fmt::format("{:>16}", fmt::format("{} {}", f.structure, f.name));
  std::cout << fmt::format("{:>8}\n", "goals");
  for (const StrengthResult& result : all) {
    std::cout << fmt::format("{:>6g}", result.u);
    if (!result.refusal.empty()) {
      std::cout << "  refused: " << result.refusal << "\n";
      continue;
    }
    std::cout << fmt::format("{:>9}{:>7}{:>9.1f}", result.needles, result.seeds,
                             result.u * static_cast<double>(result.seeds));
    for (const DoseFigure& f : dose_figures())
      std::cout << fmt::format("{:>16}", fmt::format("{} {}", figure_in(result.dose, f), f.unit));
    std::cout << fmt::format("{:>8}\n", fmt::format("{} of {}", result.met, result.goals));
  }
}

nlohmann::ordered_json to_json(const StrengthResult& result) {
  nlohmann::ordered_json json = {{"strength_u", result.u}};
  if (!result.refusal.empty()) {
    json["refused"] = result.refusal;
    return json;
  }
  json.update({{"needles", result.needles},
               {"seeds", result.seeds},
               {"goals", result.goals},
               {"goals_met", result.met}});
  for (const DoseFigure& f : dose_figures())
    if (const double value = figure_of(result.dose, f); std::isfinite(value))
      json["figures"].push_back(
          {{"structure", f.structure}, {"figure", f.name}, {"unit", f.unit}, {"value", value}});
  return json;
}

}  // namespace

int compare_strengths(const std::vector<double>& strengths_u, PlanRequest request,
                      const std::vector<Structure>& structures, const Scene& scene, bool json) {
  std::vector<StrengthResult> all;
  Progress progress("plan");
  for (const double u : strengths_u) {
    progress.show(static_cast<double>(all.size()) / static_cast<double>(strengths_u.size()),
                  text_of(u) + " U");
    request.strength_u = u;
    all.push_back(plan_of(u, request, structures, scene));
  }
  progress.finish();
  if (json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const StrengthResult& result : all) list.push_back(to_json(result));
    std::cout << list.dump() << "\n";
  } else {
    print_table(all);
  }
  const bool has_any =
      std::ranges::any_of(all, [](const StrengthResult& result) { return result.refusal.empty(); });
  return has_any ? kExitOk : kExitRefused;
}

}  // namespace brachy
