#pragma once

#include <cstdint>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// The gland's surface in the tick of a frozen ultrasound image, as its field has deformed it.
struct FrozenGland {
  std::uint64_t tick = 0;
  std::vector<Vec3> vertices;  ///< mm, W; of the first of load_structures()
};

}  // namespace brachy
