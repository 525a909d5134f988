#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// Sets `labels` (grid.count() values) to `value` where a voxel's centre is inside the surface, by a line through each
/// row of voxels. Returns how many were set. Threads: any, independent calls. Not real-time.
std::size_t rasterise(const SurfaceBvh& surface, const VoxelGrid& grid, std::uint16_t value,
                      std::vector<std::uint16_t>& labels);

}  // namespace brachy
