#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/plan/template_grid.h"

namespace brachy {

/// The needles that may be loaded, as SeedLoading uses them: every needle that was ever planned, by its number.
struct LoadingPlan {
  /// Seeds of all needles together, the withdrawn ones too, at most; there are no more needles than seeds.
  static constexpr std::size_t kMostSeeds = 4096;

  std::vector<PlannedSeed> seeds;            ///< Plan::seeds
  std::vector<std::size_t> first_of_needle;  ///< in `seeds`, and its end
  std::vector<Vec3> tips;                    ///< planned ones, by needle
  std::vector<char> is_withdrawn;            ///< by needle: it is no longer in the plan

  LoadingPlan() = default;
  /// Errors: UserError where a hole is not in the grid.
  LoadingPlan(const Plan& plan, const TemplateGrid& grid, std::vector<char> withdrawn = {})
      : seeds(plan.seeds(grid)), is_withdrawn(std::move(withdrawn)) {
    is_withdrawn.resize(plan.needles.size(), 0);
    std::size_t seed = 0;
    for (std::size_t n = 0; n < plan.needles.size(); ++n) {
      tips.push_back(plan.planned_tip(grid, n));
      first_of_needle.push_back(seed);
      seed += plan.needles[n].seed_offsets_mm().size();
    }
    first_of_needle.push_back(seeds.size());
  }

  std::size_t needle_count() const { return tips.size(); }
  bool is_in_use(std::size_t needle) const { return needle < tips.size() && !is_withdrawn[needle]; }

  /// Memory for any plan that takes the place of this one, so that copying it does not allocate.
  void reserve() {
    seeds.reserve(kMostSeeds);
    first_of_needle.reserve(kMostSeeds + 1);
    tips.reserve(kMostSeeds);
    is_withdrawn.reserve(kMostSeeds);
  }
};

}  // namespace brachy
