#pragma once

#include <string>
#include <vector>

#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// A volume of numbers: dose or image.
struct VoxelVolume {
  VoxelGrid grid;             ///< RAS
  std::string frame;          ///< UID of the frame of reference
  std::vector<float> values;  ///< Gy, or the image's rescaled values; x fastest
};

}  // namespace brachy
