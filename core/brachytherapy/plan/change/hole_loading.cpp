#include "core/brachytherapy/plan/change/hole_loading.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/one_line.h"

namespace brachy {

HoleLoading load_hole(const std::vector<GlandHole>& holes, const TemplateGrid& grid,
                      const std::string& hole) {
  const std::string where = "hole " + one_short_line(hole) + ": ";
  if (!grid.position(hole)) throw UserError(where + grid.lacks(hole));
  const auto found = std::ranges::find(holes, hole, &GlandHole::name);
  if (found == holes.end())
    throw UserError(where + "its needle does not pass through the gland; give its depth and its train");
  HoleLoading loading{std::floor(found->far_mm), "s"};
  double seed_mm = loading.depth_mm - PlanNeedle::kSeedMm / 2;
  for (seed_mm -= PlanNeedle::kSeedMm + PlanNeedle::kSpacerMm; seed_mm >= found->near_mm;
       seed_mm -= PlanNeedle::kSeedMm + PlanNeedle::kSpacerMm)
    loading.train += "-s";
  return loading;
}

}  // namespace brachy
