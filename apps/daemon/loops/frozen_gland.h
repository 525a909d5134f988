#pragma once

#include <cstdint>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// The gland's surface in the tick of frozen ultrasound images, as its field has deformed it.
struct FrozenGland {
  std::uint64_t tick = 0;
  std::vector<Vec3> vertices;        ///< mm, W; of the first of load_structures()
  std::vector<RigidTransform> X_WI;  ///< of the images: image to world
};

}  // namespace brachy
