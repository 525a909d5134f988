#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

using Vec2 = Eigen::Vector2d;
using Polygon = std::vector<Vec2>;  ///< closed: the last point joins the first; mm in its plane

/// The contours of a structure in one plane: a point is inside where a ray crosses them an odd number of times, so a
/// contour within another is a hole.
struct ContourPlane {
  double height_mm = 0;  ///< along the stack's normal
  std::vector<Polygon> polygons;
};

/// Contours in parallel planes. A point of the plane at height h with coordinates (u, v) is axes · (u, v, h).
struct ContourStack {
  Mat3 axes =
      Mat3::Identity();  ///< columns: u, v and the normal; orthonormal, right-handed; world frame (RAS)
  std::vector<ContourPlane> planes;  ///< by increasing height
  double spacing_mm = 0;             ///< the median distance between neighbouring planes; 0 with one plane
  std::size_t repeated = 0;          ///< contours that occurred twice and were taken once
  std::size_t missing_planes = 0;    ///< by the gaps between planes
  std::size_t crossing_planes = 0;   ///< in which two contours cross: what lies in both is outside

  Vec3 position(const Vec2& p, double height_mm) const { return axes * Vec3(p.x(), p.y(), height_mm); }
  /// To the plane above; infinite above the last one.
  double gap_mm(std::size_t plane) const;
  /// Whether a piece ends at this plane: it is the last, or the gap above it is over kBridgedGap times the spacing and
  /// the gaps beside it.
  bool is_piece_end(std::size_t plane) const;
};

/// Whether one of the contours encloses an area: else stack_contours finds nothing in them.
bool has_area(std::span<const std::vector<Vec3>> contours);

/// Sorts closed planar contours (mm, RAS; any order, either winding) into planes. The normal is that of the largest
/// contour, turned so that its largest component is positive. Planes closer than kSamePlaneMm are one. The two edges of
/// a channel that connects a hole to the outer contour ("keyhole") fall out, as do contours of fewer than three points.
///
/// Errors: UserError "name: …" where no contour is left, one is not planar or not parallel to the others, a point is
/// not finite or farther than kMostMm from the origin, or a contour has over kMostContourPoints.
ContourStack stack_contours(std::span<const std::vector<Vec3>> contours, const std::string& name);
inline constexpr double kSamePlaneMm = 0.01, kOffPlaneMm = 0.1, kMostMm = 1e5;
inline constexpr std::size_t kMostContourPoints =
    50'000;  ///< channels are found in time that grows by its square

/// More than this many times the spacing, and the gaps beside it, is a gap that separates two pieces.
inline constexpr double kBridgedGap = 4.5;

}  // namespace brachy
