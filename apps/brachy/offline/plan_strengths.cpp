#include "apps/brachy/offline/plan_strengths.h"

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/command_line/exit_code.h"
#include "apps/score/goal_results.h"
#include "apps/score/report_figures.h"
#include "apps/terminal/progress.h"
#include "core/base/number_text.h"

namespace brachy {
namespace {

struct OfStrength {
  double u = 0;
  std::string refusal;  ///< empty: there is a plan
  std::size_t needles = 0, seeds = 0;
  DoseStage dose;
  std::size_t goals = 0, met = 0;
};

OfStrength plan_of(double u, const PlanRequest& request, const std::vector<Structure>& structures,
                   const Scene& scene) {
  OfStrength of;
  of.u = u;
  try {
    const MadePlan made = make_plan(structures, scene.template_grid, request);
    of.needles = made.plan.needles.size();
    of.seeds = made.plan.seed_count();
    DoseScore score = score_dose(made.plan, scene.template_grid, made.structures, scene.dose, nullptr);
    of.dose = std::move(score.plan);
    score.plan = of.dose;
    for (const GoalResult& result :
         judge(request.goals.empty() ? default_dose_goals() : request.goals, score)) {
      if (!result.goal.is_of_plan() || !result.is_met) continue;
      ++of.goals;
      of.met += *result.is_met;
    }
  } catch (const PlanRefused& e) {
    of.refusal = e.what();
  }
  return of;
}

void print_table(const std::vector<OfStrength>& all) {
  std::cout << fmt::format("{:>6}{:>9}{:>7}{:>9}", "U", "needles", "seeds", "U in all");
  for (const DoseFigure& f : dose_figures())
    std::cout << fmt::format("{:>16}", fmt::format("{} {}", f.structure, f.name));
  std::cout << fmt::format("{:>8}\n", "goals");
  for (const OfStrength& of : all) {
    std::cout << fmt::format("{:>6g}", of.u);
    if (!of.refusal.empty()) {
      std::cout << "  refused: " << of.refusal << "\n";
      continue;
    }
    std::cout << fmt::format("{:>9}{:>7}{:>9.1f}", of.needles, of.seeds,
                             of.u * static_cast<double>(of.seeds));
    for (const DoseFigure& f : dose_figures())
      std::cout << fmt::format("{:>16}", fmt::format("{} {}", figure_in(of.dose, f), f.unit));
    std::cout << fmt::format("{:>8}\n", fmt::format("{} of {}", of.met, of.goals));
  }
}

nlohmann::ordered_json to_json(const OfStrength& of) {
  nlohmann::ordered_json json = {{"strength_u", of.u}};
  if (!of.refusal.empty()) {
    json["refused"] = of.refusal;
    return json;
  }
  json.update({{"needles", of.needles}, {"seeds", of.seeds}, {"goals", of.goals}, {"goals_met", of.met}});
  for (const DoseFigure& f : dose_figures())
    if (const double value = figure_of(of.dose, f); std::isfinite(value))
      json["figures"].push_back(
          {{"structure", f.structure}, {"figure", f.name}, {"unit", f.unit}, {"value", value}});
  return json;
}

}  // namespace

int compare_strengths(const std::vector<double>& strengths_u, PlanRequest request,
                      const std::vector<Structure>& structures, const Scene& scene, bool json) {
  std::vector<OfStrength> all;
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
    for (const OfStrength& of : all) list.push_back(to_json(of));
    std::cout << list.dump() << "\n";
  } else {
    print_table(all);
  }
  const bool has_any = std::ranges::any_of(all, [](const OfStrength& of) { return of.refusal.empty(); });
  return has_any ? kExitOk : kExitRefused;
}

}  // namespace brachy
