#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/geometry/contours/contour_stack.h"

namespace brachy {

/// A grid of square cells in the plane of contours: point (i, j) at origin + pitch · (i, j).
struct SliceGrid {
  Vec2 origin = Vec2::Zero();  ///< mm
  double pitch_mm = 1;
  std::array<std::size_t, 2> size{};

  Vec2 position(std::size_t i, std::size_t j) const {
    return origin + pitch_mm * Vec2(static_cast<double>(i), static_cast<double>(j));
  }
};

/// The signed distance to the contours of a plane, mm, negative inside (odd number of crossings), at the grid's points,
/// i fastest. Within one pitch of a contour it is exact; farther away the nearest edge is found by propagation (as
/// P.-E. Danielsson, "Euclidean distance mapping", CGIP 14, 1980), which is exact but for rare points that are off by a
/// small part of the pitch. The grid must contain all of the contours.
std::vector<float> slice_distance(std::span<const Polygon> polygons, const SliceGrid& grid);

}  // namespace brachy
