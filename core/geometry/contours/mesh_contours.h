#pragma once

#include <vector>

#include "core/geometry/contours/plane_shapes.h"
#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// Where a closed surface meets the plane z = height_mm (world frame): closed polygons in (x, y), mm, one for each
/// loop. A vertex in the plane is taken to lie above it, so that the loops are always closed. Points closer than
/// 1e-6 mm become one. Empty where the surface is elsewhere. Preconditions: every edge has two triangles.
std::vector<Polygon> mesh_contours(const SurfaceMesh& mesh, double height_mm);

/// The same inside as one contour for each body: a hole is joined to its outer contour by a channel that is passed
/// there and back ("keyhole", PS3.3, C.8.8.6.3), wound the other way round, so that it stays a hole where a reader
/// fills each contour by itself. Throws what plane_shapes throws.
std::vector<Polygon> with_keyholes(const std::vector<Polygon>& polygons);

/// Heights at which to cut a structure that spans min … max: the middles of slabs of `spacing_mm`, one of which
/// begins at 0; on one raster for all structures, as readers expect. contour_surface() gives a flat end back
/// exactly where it lies between two slabs, else within half the spacing.
std::vector<double> contour_heights(double min_mm, double max_mm, double spacing_mm);

}  // namespace brachy
