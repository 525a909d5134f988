#pragma once

#include <cstdint>
#include <span>

#include "core/geometry/surface/surface_mesh.h"
#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

struct LabelSurfaceOptions {
  int smoothing_steps = 24;  ///< of the net; 0 leaves the stairs of the voxels
  std::size_t most_vertices = 8'000'000;
};

struct LabelSurface {
  SurfaceMesh mesh;       ///< closed, outward, every edge with two triangles; mm, RAS
  double voxels_cc = 0;   ///< volume of the voxels
  double surface_cc = 0;  ///< volume of the surface
  std::size_t voxels = 0;
};

/// The surface of the voxels that have `value`. Surface nets: each vertex is drawn to the mean of its neighbours, step
/// by step, but stays within its cell of eight voxels (S. Gibson, "Constrained elastic surface nets", MICCAI 1998), so
/// that it is never farther than half a voxel from where the voxels change. The smoothing takes volume from what is
/// convex: the surface is then moved along its normals, in voxels, by the one distance that gives it the volume of the
/// voxels, to 0.1 %, and moved so that its middle is theirs; where that is over a quarter of a voxel, as of a tube a
/// few voxels wide, it is smoothed less. Deterministic. `labels` has grid.count() values. Voxels at the grid's border
/// are closed half a voxel beyond.
///
/// Errors: UserError where no voxel has the value, or there are too many vertices. Threads: any. Not real-time.
LabelSurface label_surface(const VoxelGrid& grid, std::span<const std::uint16_t> labels, std::uint16_t value,
                           const LabelSurfaceOptions& options = {});

}  // namespace brachy
