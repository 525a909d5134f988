#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

using Vec2 = Eigen::Vector2d;

/// An edge of a region of a plane, mm in the plane's x and y.
using PlaneEdge = std::array<Vec2, 2>;

/// The cross-section of a closed mesh with the plane z = 0 of the frame S: its outline as edges in no order, in the
/// plane's x and y. Each point of the outline ends as many edges as it begins; the inside is where a ray crosses an odd
/// number of edges. Empty where the plane misses the mesh. Not real-time.
std::vector<PlaneEdge> plane_section(const SurfaceMesh& mesh, const RigidTransform& X_WS);

/// Closed outlines of a section's edges: each point is joined to the next, the last to the first. An outline that does
/// not close is left out.
std::vector<std::vector<Vec2>> outlines_of(std::span<const PlaneEdge> edges);

}  // namespace brachy
