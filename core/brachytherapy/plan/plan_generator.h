#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/brachytherapy/plan/gland_loading.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// Requirements of a generated plan.
struct PlanSettings {
  std::string name;  ///< one line
  SourceModel source = SourceModel::kAmersham6711;
  double prescription_gy = 145;
  double needle_length_mm = 200;
  std::size_t max_seeds = 256;
};

/// Goals of a plan (core/DESIGN.md, section 6); percent of the volume, and of the prescription.
struct PlanGoals {
  static constexpr double kLeastV100 = 95, kMostV150 = 60, kMostUrethraD30 = 125;
};

/// A plan for any gland, `structures.front()`: modified peripheral loading by a rule
/// (core/brachytherapy/plan/gland_loading.h), scaled to the prescription. No optimiser: rules are tried in a
/// fixed order (needles at least 7 mm apart, then 4.5; 5 mm off the urethra, then 3; seeds of the rim about 7
/// mm apart, then 10; five ways of loading the interior), each with the strength that gives 96 % of the gland
/// the prescription, as dose is linear in it; the first that stays below 95 % of both V150's and urethra
/// D30's goal is used, else the one that comes nearest. Doses are exact sums
/// (core/brachytherapy/dose/dose_rate.h) at 6,000 points spread evenly over the gland and 1,500 over the
/// urethra. The strength is rounded up to 0.001 U. Where no rule reaches the goals the plan misses them:
/// `brachy plan` reports it.
///
/// Deterministic. 0.1 s for the default phantom, up to some seconds where all rules are tried. Errors:
/// UserError where the template does not face the gland, no needle fits into it, its base is farther from the
/// template than a needle reaches, or it needs more seeds than settings.max_seeds.
/// `progress`, if any, is called before each rule with the share of rules tried.
Plan generate_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                   const PlanSettings& settings, const std::function<void(double share)>& progress = {});

}  // namespace brachy
