#pragma once

#include <string>

#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// What is wrong with the place of a file's grid, with the fix ("step 2 is 0 mm long, …; correct it, or the unit");
/// empty: nothing. Voxels are 0.1 µm to 1 m apart along axes whose directions' determinant is at least `independence`,
/// within 1 km of the origin.
std::string place_fault(const VoxelGrid& grid, double independence = 1e-3);

}  // namespace brachy
