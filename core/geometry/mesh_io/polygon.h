#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// Cuts a simple polygon, nearly plane, convex or not, into n − 2 triangles of its own corners (indices into
/// `corners`) with its winding: ear clipping, best-shaped ear first. The remainder of a self-intersecting polygon, and
/// polygons of over 100 corners, become a fan from one corner. About n² steps, which are added to `work`.
std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(std::span<const Vec3> corners,
                                                              std::size_t& work);

}  // namespace brachy
