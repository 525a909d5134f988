#pragma once

#include <array>
#include <cstddef>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// Bounding box of the phantom before scaling, mm. Numbers, since a vector of Eigen's is no constant: what another
/// file's constant is made of it can be made before it.
inline constexpr std::array<double, 3> kPhantomSize = {50, 40, 45};
inline Vec3 phantom_size() {
  return {kPhantomSize[0], kPhantomSize[1], kPhantomSize[2]};
}

/// A prostate-shaped surface for scenes without a patient: closed, outward, smooth, star-shaped about the origin, with
/// exactly `surface_vertices` vertices (50 … 1,000,000); mm, RAS.
///
/// Bounding box 50 (x, right–left) × 40 (y, anterior +) × 45 mm (z, base +, apex −), centred at the origin:
/// clinical size, a gland in the upper part of what is implanted (guidelines advise up to 50–60 cc; the clinic's
/// width × height × length × π/6 gives 47 cc here, and so does the shape; a healthy young gland has about
/// 40 × 30 × 30 mm). The form follows the anatomy books, not a patient: an inverted cone with a broad base
/// against the bladder and a tapering apex, full lateral lobes, a flat back towards the rectum with a shallow median
/// sulcus, a slight hollow at the bladder neck.
/// Errors: UserError where surface_vertices is out of range.
SurfaceMesh prostate_phantom(std::size_t surface_vertices = 1200);

}  // namespace brachy
