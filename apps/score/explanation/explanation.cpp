#include "apps/score/explanation/explanation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "apps/score/explanation/hand_causes.h"
#include "apps/score/explanation/tissue_causes.h"

namespace brachy {

Vec3 Explanation::expected_of(const Vec3& planned, const SeedDeviation* near, std::size_t at) const {
  Vec3 off(0, 0, depth_of_all_mm);
  off.head<2>() += of_template.moved(planned.head<2>());
  if (!near) return off;
  off = near->dropped + near->moved;
  // What only that seed did is not its neighbour's.
  for (const Cause& cause : causes)
    if (cause.kind == Cause::Kind::kSeeds || cause.kind == Cause::Kind::kFront ||
        cause.kind == Cause::Kind::kBack)
      off -= cause.part[at];
  return off;
}

Explanation explain(const Deviations& deviations) {
  Explanation all;
  if (deviations.seeds.empty()) return all;
  HandCauses(deviations, all).find();
  TissueCauses(deviations, all).find();
  for (Cause& cause : all.causes)
    for (std::size_t i = 0; i < cause.part.size(); ++i)
      if (!cause.part[i].isZero()) cause.seeds.push_back(i);
  return all;
}

}  // namespace brachy
