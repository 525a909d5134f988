#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/models/blended/membership.h"

namespace brachy {

/// Where one membership w_m is not 0: the blocks that have such a point, as points to evaluate a field at.
struct TissuePart {
  Tissue points;                        ///< no triangles
  std::vector<std::uint32_t> block_of;  ///< which block of the whole each one is, ascending
  std::vector<float> shares;            ///< w_m of its points, kBlockSize a block; 0 where a block is short
};

/// One for each tissue of `membership`.
std::vector<TissuePart> parts_of(const Tissue& tissue, const Membership& membership);

}  // namespace brachy
