#pragma once

#include <cstddef>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

using Vec2 = Eigen::Vector2d;
using Polygon = std::vector<Vec2>;  ///< closed: the last point joins the first; mm in its plane

/// What one contour of a plane encloses, or several that cross: of these a point is inside where it lies in an odd
/// number.
struct PlaneShape {
  std::vector<Polygon> polygons;
  std::size_t depth = 0;  ///< number of other shapes of the plane that it lies in; odd: it is a hole
  double area_mm2 = 0;
  Vec2 centroid = Vec2::Zero();
  Eigen::AlignedBox2d box;

  bool is_hole() const { return depth % 2 != 0; }
  bool contains(const Vec2& p) const;
};

/// Of the plane's inside, mm²: the shapes without their holes.
double area_mm2(const std::vector<PlaneShape>& shapes);

/// A contour as simple loops: it is cut where it touches itself, and an edge that it passes there and back, the channel
/// of a "keyhole" to a hole, falls out. A contour that goes round twice is taken once. Points closer than kSamePointMm
/// are one. Time grows with the number of points.
std::vector<Polygon> simple_loops(const Polygon& contour);
inline constexpr double kSamePointMm = 0.02;

/// Drops polygons that lie within kRepeatedMm of another one, whatever their first point, direction and number of
/// points. Returns how many were dropped.
std::size_t drop_repeated(std::vector<Polygon>& polygons);
inline constexpr double kRepeatedMm = 0.1;

/// The shapes of a plane. `pairs`: of edges that were looked at for crossings, added to. Errors: UserError "name: …"
/// beyond kMostShapes polygons or kMostPlanePoints points of a plane, or kMostPairs.
std::vector<PlaneShape> plane_shapes(std::vector<Polygon> polygons, const std::string& name,
                                     std::size_t& pairs);
inline constexpr std::size_t kMostShapes = 2'000, kMostPlanePoints = 100'000, kMostPairs = 200'000'000;

}  // namespace brachy
