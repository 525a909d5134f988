#pragma once

#include <cstddef>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// Where a planned seed came to lie, against its plan. mm, world frame W; needles go along +z.
struct SeedDeviation {
  std::size_t index = 0, needle = 0;  ///< in Plan::seeds and in Plan::needles
  double offset_mm = 0;               ///< PlannedSeed::offset_mm
  Vec3 planned = Vec3::Zero();
  Vec3 dropped = Vec3::Zero();  ///< where it fell − planned: the hand's part
  Vec3 moved = Vec3::Zero();    ///< at rest − where it fell: the tissue's part
};

/// What is explained. Seeds of one needle stand together, from the tip backwards.
struct Deviations {
  std::vector<SeedDeviation> seeds;
  std::vector<Vec3> tips;            ///< planned ones, of each needle of the plan
  std::vector<char> is_unpunctured;  ///< of each needle: its seeds fell and it never went through the capsule
  double hole_spacing_mm = 5;
  Vec3 gland_centre = Vec3::Zero();  ///< mm: about which it swells
};

}  // namespace brachy
