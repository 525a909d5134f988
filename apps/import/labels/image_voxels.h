#pragma once

#include <vector>

#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// An image from a file that has no frame of reference but its grid.
struct ImageVoxels {
  VoxelGrid grid;             ///< RAS
  std::vector<float> values;  ///< x fastest
};

}  // namespace brachy
