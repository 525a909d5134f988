#pragma once

#include <cstdint>
#include <vector>

#include "core/brachytherapy/dose/dose_grid.h"
#include "core/geometry/surface/surface_bvh.h"

namespace brachy {

/// The part of a dose grid's voxels (cubes of one spacing about its points) that a structure fills.
struct StructureVoxels {
  /// The part of a voxel inside the structure, or a piece of that part.
  struct Part {
    Vec3 centre;        ///< mm, world frame
    double volume_mm3;  ///< > 0
  };
  /// voxels that are all inside: indices in DoseGrid::dose_gy(), increasing
  std::vector<std::uint32_t> whole;
  std::vector<Part> parts;
  double volume_cc = 0;  ///< of all of these, without what lies outside the grid
};

/// By rays along z, no more than kRaySpacingMm apart and at least four by four per voxel or piece: their lengths inside
/// are exact. A structure of few voxels, for which the DVH would be coarse, is divided into pieces of voxels, more than
/// kPieces in all (but no more than kFinest along a side).
StructureVoxels structure_voxels(const SurfaceBvh& surface, const DoseGrid& grid);
inline constexpr double kRaySpacingMm = 0.25, kPieces = 20'000, kFinest = 8;

}  // namespace brachy
