#pragma once

#include <string>

#include "core/geometry/contours/contour_stack.h"
#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

struct ContourSurface {
  SurfaceMesh mesh;  ///< closed, outward, every edge with two triangles; mm, RAS
  /// Volume of the contours: areas times the distance between the planes' midplanes. Not of contours that cross.
  double slabs_cc = 0;
  double surface_cc = 0;
};

/// The closed surface of contours in parallel planes: of each piece (contour_pieces) the signed distance to the
/// contours is exact in each plane and linear between planes, in the coordinates that follow the piece (S. Raya, J.
/// Udupa, "Shape-based interpolation of multidimensional objects", IEEE TMI 9, 1990; along a piece: W.
/// Higgins, C. Morice, E. Ritman, "Shape-based interpolation of tree-like structures", IEEE TMI 12, 1993), and the
/// surface is where it is 0, by surface_nets; between planes it is at the level that has the area between theirs, so
/// that what swells, narrows or parts keeps the contours' volume there. Contours of a plane may branch, have holes, and
/// change in number. Planes that are missing are interpolated, up to a gap of kBridgedGap spacings; a longer one
/// separates two pieces. The first and the last plane of a piece stand for a slab that ends half the distance to the
/// next plane (at most half the spacing) beyond it, flat. A single plane gets a slab of `spacing_mm` of the stack, or
/// 1 mm where that is 0. Surfaces of pieces may lie within each other, and do not cross where contours do not. Each is
/// moved along its normals, by at most 0.2 mm, to the volume of the contours' slabs.
///
/// The grid fits each piece: 0.25 … 1 mm, and coarser only for a surface of over 200 cm², as of a trunk. Errors:
/// UserError "name: …" where it would have over 64 million nodes. Threads: any. Not real-time.
ContourSurface contour_surface(const ContourStack& stack, const std::string& name);

}  // namespace brachy
