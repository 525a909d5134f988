#pragma once

#include <cstddef>
#include <vector>

#include "apps/score/explanation/deviation.h"
#include "apps/score/explanation/robust.h"

namespace brachy {

/// Where a needle's seeds fell, on the whole.
struct NeedlePlace {
  std::size_t needle = 0;
  std::vector<std::size_t> seeds;                        ///< in Deviations::seeds, from the tip backwards
  Vec2 at = Vec2::Zero();                                ///< planned, x and y
  Vec2 across = Vec2::Zero();                            ///< x and y of the deviation of those that agree
  double along = 0;                                      ///< z
  std::vector<std::size_t> follow_across, follow_along;  ///< of `seeds`: those that agree
};

/// Of each needle of which seeds fell, by `rest`: what is still unexplained of each seed's deviation as it fell.
std::vector<NeedlePlace> needle_places(const Deviations& deviations, const std::vector<Vec3>& rest);

}  // namespace brachy
