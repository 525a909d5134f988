#pragma once

#include "core/geometry/tissue/tissue.h"

namespace brachy {

/// The centre of the bounding box of the tissue's points, mm.
inline Vec3 centre_of(const Tissue& tissue) {
  Vec3 min = tissue.blocks.front().min, max = tissue.blocks.front().max;
  for (const Block& block : tissue.blocks) {
    min = min.cwiseMin(block.min);
    max = max.cwiseMax(block.max);
  }
  return 0.5 * (min + max);
}

}  // namespace brachy
