#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// A surface in the coordinates of the grid that it was extracted from.
struct NetSurface {
  SurfaceMesh mesh;  ///< vertices in grid indices (i, j, k); wound outward for a right-handed grid
  /// of each vertex: the cell it belongs to lies from here to here + 1; −1 in the border
  std::vector<std::array<std::int32_t, 3>> cells;
};

/// The surface where a field on a grid is 0, by dual contouring with naive placement: a vertex in each cell of eight
/// nodes through which the surface passes, at the mean of the points where it crosses the cell's edges (S. Gibson,
/// "Constrained elastic surface nets", MICCAI 1998); one vertex for each sheet of the surface in the cell (G. Nielson,
/// "Dual marching cubes", IEEE Visualization 2004). Nodes with a negative value are inside; inside nodes that only meet
/// over a diagonal are apart. Where two sheets would share an edge, which Nielson's scheme allows, the edge is split,
/// so that the surface is closed and every edge has two triangles.
///
/// `fill(k, layer)` writes the size[0] × size[1] values of layer k, i fastest; called once for each k in order. Values
/// are finite. Nodes beyond the grid have the value `outside` > 0. Memory: two layers and the surface.
/// Errors: UserError beyond `most_vertices`. Threads: any, independent calls. Not real-time.
NetSurface surface_nets(const std::array<std::size_t, 3>& size,
                        const std::function<void(std::size_t k, std::span<float> layer)>& fill, float outside,
                        std::size_t most_vertices = 8'000'000);

}  // namespace brachy
