#pragma once

#include "core/base/rigid_transform.h"
#include "core/injectivity/cell_loops.h"

namespace brachy {

/// Points about a source that pushes `ahead` (unit), up to 2 `distance` (mm) from it: straight ahead, where
/// the field is compressed most; two rings about that; and behind.
inline void surround(const Vec3& ahead, double distance, CellPoints& X) {
  const Vec3 side = ahead.unitOrthogonal(), up = ahead.cross(side);
  const Eigen::Vector3f a = (distance * ahead).cast<float>(), b = (distance * side).cast<float>(),
                        c = (distance * up).cast<float>();
  constexpr float kHalf = 0.70710678f;
  constexpr float kTurns[8][2] = {{1, 0},  {kHalf, kHalf},   {0, 1},  {-kHalf, kHalf},
                                  {-1, 0}, {-kHalf, -kHalf}, {0, -1}, {kHalf, -kHalf}};
  for (std::size_t k = 0; k < CellPoints::kCount; ++k) {
    const std::size_t group = k / 8, turn = k % 8;
    const float f = 0.2f * static_cast<float>(1 + turn);
    const float forward[4] = {f, 0.9f, 0.5f, -f}, aside[4] = {0, 0.45f, 0.9f, 0};
    const float p = forward[group], q = aside[group] * kTurns[turn][0], r = aside[group] * kTurns[turn][1];
    X.x[k] = p * a.x() + q * b.x() + r * c.x();
    X.y[k] = p * a.y() + q * b.y() + r * c.y();
    X.z[k] = p * a.z() + q * b.z() + r * c.z();
  }
}

}  // namespace brachy
