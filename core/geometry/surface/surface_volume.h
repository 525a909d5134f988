#pragma once

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// Enclosed by a closed surface that is wound outward, mm³.
double enclosed_mm3(const SurfaceMesh& mesh);

/// The middle of what a closed surface encloses, mm; its first vertex where that is nothing.
Vec3 enclosed_centroid(const SurfaceMesh& mesh);

/// Moves a closed surface along its vertices' normals, all by one distance of at most `most_mm`, until it encloses
/// volume_mm3 to 0.1 %, or the distance is used up.
void move_to_volume(SurfaceMesh& mesh, double volume_mm3, double most_mm);

/// How far a margin reaches, mm, each ≥ 0.
struct Margins {
  double mm = 0;            ///< along x, z and +y
  double posterior_mm = 0;  ///< along −y
};

/// A closed surface with a margin around: each vertex moves by what an ellipsoid of these semi-axes reaches beyond a
/// surface of its normal (the support function of Minkowski's sum), which is exact for convex surfaces.
SurfaceMesh with_margins(const SurfaceMesh& mesh, const Margins& margins);

}  // namespace brachy
