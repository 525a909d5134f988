#pragma once

#include <cstdint>
#include <vector>

#include "core/dose/dose_grid.h"
#include "core/surface/surface_bvh.h"

namespace brachy {

/// What of a dose grid's voxels (cubes of one spacing about its points) a structure fills.
struct StructureVoxels {
  /// A voxel's part inside the structure, or a piece of that.
  struct Part {
    Vec3 centre;        ///< mm, world frame
    double volume_mm3;  ///< > 0
  };
  std::vector<std::uint32_t>
      whole;  ///< voxels that are all inside: indices in DoseGrid::dose_gy(), increasing
  std::vector<Part> parts;
  double volume_cc = 0;  ///< of all of these; what lies outside the grid is not in it
};

/// By rays along z, no more than kRaySpacingMm apart and at least four by four a voxel or piece: their lengths inside
/// are exact. A structure of few voxels, whose DVH these would tell coarsely, is cut into pieces of a voxel, more than
/// kPieces in all (but no more than kFinest a side).
StructureVoxels structure_voxels(const SurfaceBvh& surface, const DoseGrid& grid);
inline constexpr double kRaySpacingMm = 0.25, kPieces = 20'000, kFinest = 8;

}  // namespace brachy
