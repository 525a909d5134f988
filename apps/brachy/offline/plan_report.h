#pragma once

#include <string>
#include <vector>

#include "apps/score/goal_results.h"
#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// The report of `brachy plan`.
struct PlanReport {
  Plan plan;
  TemplateGrid grid;
  DoseStage dose;                  ///< of its seeds at their planned positions, at rest
  double customary_u = 0;          ///< customary_strength_u() of the gland's mean dimension
  std::vector<DoseGoal> goals;     ///< what is asked of a plan; those of an implant are left out
  std::vector<std::string> notes;  ///< what was assumed for the plan
  std::size_t placed_seeds = 0;    ///< whose dose is in `dose` too: a plan of what is left

  double total_u() const { return static_cast<double>(plan.seed_count()) * plan.air_kerma_strength_u; }
};

std::string to_text(const PlanReport& report);
std::string to_json(const PlanReport& report);  ///< one line

}  // namespace brachy
