#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/rigid_transform.h"

namespace brachy {

/// Cuts a simple polygon, nearly plane, convex or not, into n − 2 triangles of its own corners (numbers into
/// `corners`), wound alike: ear clipping, fattest ear first. What is left of a crossed polygon, and polygons of over
/// 100 corners, are cut as a fan from one corner.
std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(std::span<const Vec3> corners);

}  // namespace brachy
