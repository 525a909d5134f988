#pragma once

#include <cstddef>
#include <string>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

struct SurfaceOptions {
  double weld_tolerance_mm = 1e-4;  ///< vertices at most this far apart become one, ≥ 0
  double min_island_share = 0.01;  ///< smaller components are dropped, as a share of the total size, 0 … 0.5
};

/// What prepare_surface found; counts are of the prepared mesh unless they say otherwise.
struct SurfaceReport {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t components = 0;  ///< kept, connected over edges
  std::size_t cavities = 0;    ///< of those, the ones inside another: their normals point into the hollow

  std::size_t welded_vertices = 0;       ///< input vertices that became another one
  std::size_t degenerate_triangles = 0;  ///< dropped: two corners were welded
  std::size_t duplicate_triangles = 0;   ///< dropped: same three corners, either winding
  std::size_t flipped_triangles = 0;     ///< kept, winding reversed
  std::size_t dropped_islands = 0;
  double dropped_island_volume_cc = 0;  ///< Σ |volume| of the dropped

  std::size_t bad_edges = 0;          ///< the three below together
  std::size_t open_edges = 0;         ///< with one triangle
  std::size_t nonmanifold_edges = 0;  ///< with three or more
  std::size_t twisted_edges = 0;      ///< with two that cannot be wound alike (not orientable)
  bool watertight = false;            ///< triangles > 0 and bad_edges = 0

  double volume_cc = 0;  ///< enclosed, cavities subtracted; meaningless unless watertight
  Vec3 min_mm = Vec3::Zero(), max_mm = Vec3::Zero();
};

struct PreparedSurface {
  SurfaceMesh mesh;
  SurfaceReport report;
};

/// Validates and repairs a triangle soup, and reports the changes. It accepts an open or non-manifold surface
/// (require_closed refuses those), so that such a mesh can be inspected.
///
/// Vertices are welded by position: in lexicographic order of position each joins the first representative within
/// the tolerance, whose position is kept. Triangles that lost a corner and repeated triangles are dropped; flat ones
/// with three distinct corners stay: without them their neighbours would have open edges. Islands are components
/// smaller than min_island_share of the total; size is |volume|, or for an open component, whose volume is
/// meaningless, that of the sphere of its area. If the islands together make up more than a tenth, they are not
/// debris and none is dropped. Each component is wound consistently and so that its volume is positive, or negative
/// where it lies within an odd number of others (a cavity). Self-intersections are not detected.
///
/// The result's order (vertices by position; each triangle from its lowest index; triangles sorted) does not depend
/// on the input's. `name` is the file's, for messages.
/// Errors: UserError where a vertex is not finite, an index is out of range, or an option is out of range; or where the
/// pieces are so many, and so nested, that find_cavities would take longer than a few seconds.
PreparedSurface prepare_surface(const SurfaceMesh& mesh, const SurfaceOptions& options,
                                const std::string& name);

/// Errors: UserError unless the surface is closed, manifold, orientable and encloses a volume: one line with the
/// number of bad edges and what to do.
void require_closed(const SurfaceReport& report, const std::string& name);

}  // namespace brachy
