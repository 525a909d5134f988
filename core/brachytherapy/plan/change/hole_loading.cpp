#include "core/brachytherapy/plan/change/hole_loading.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/base/error.h"
#include "core/base/one_line.h"

namespace brachy {

HoleLoading load_hole(const std::vector<GlandHole>& holes, const TemplateGrid& grid,
                      const std::string& hole) {
  const std::string where = "hole " + one_short_line(hole) + ": ";
  if (!grid.position(hole)) throw UserError(where + "the template has " + grid.extent());
  std::string name = hole;
  name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
  const auto found = std::ranges::find(holes, name, &GlandHole::name);
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
