#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/contours/plane_shapes.h"

namespace brachy {

/// The contours of a structure in one plane: a point is inside where it lies in an odd number of them, so a contour
/// within another is a hole.
struct ContourPlane {
  double height_mm = 0;  ///< along the stack's normal
  std::vector<PlaneShape> shapes;
};

/// Where a series of images lies beside the contours.
struct ImageSlices {
  Vec3 normal = Vec3::UnitZ();  ///< of length 1
  double spacing_mm = 0;        ///< between slices, along the normal; 0: no images
};

/// Contours in parallel planes. A point of the plane at height h with coordinates (u, v) is axes · (u, v, h).
struct ContourStack {
  Mat3 axes =
      Mat3::Identity();  ///< columns: u, v and the normal; orthonormal, right-handed; world frame (RAS)
  std::vector<ContourPlane> planes;  ///< by increasing height
  double spacing_mm = 0;  ///< the median distance between neighbouring planes; of one plane the images', or 0
  std::size_t repeated = 0;         ///< contours that occurred twice and were taken once
  double most_apart_mm = 0;         ///< of contours that were taken to be in one plane
  double most_moved_mm = 0;         ///< of planes that were moved onto evenly spaced slices
  std::size_t missing_planes = 0;   ///< by the gaps between planes
  std::size_t crossing_planes = 0;  ///< in which two contours cross: what lies in both is outside

  Vec3 position(const Vec2& p, double height_mm) const { return axes * Vec3(p.x(), p.y(), height_mm); }
  /// To the plane above; infinite above the last one.
  double gap_mm(std::size_t plane) const;
  /// Whether a piece ends at this plane: it is the last, or the gap above it is over kBridgedGap times the spacing and
  /// the gaps beside it.
  bool is_piece_end(std::size_t plane) const;
};

/// Whether one of the contours encloses an area: else stack_contours finds nothing in them.
bool has_area(std::span<const std::vector<Vec3>> contours);

/// Sorts closed planar contours (mm, RAS; any order, either winding, any first point) into planes. The normal is the
/// mean of the contours', turned so that its largest component is positive.
///
/// Contours of one slice may lie somewhat apart. Where those within 0.05 mm make four or more evenly spaced planes, it
/// is these; else those within a quarter of the slices' distance are one plane where the planes are then evenly spaced,
/// and else those within 0.05 … 0.1 mm. The distance is the one at which most of the structure's length is drawn, or
/// the images' where contours lie far closer than their slices. Contours of alike outline that lie apart are never one
/// plane. Planes that then lie within 0.15 of their distance of evenly spaced ones are moved onto these.
///
/// A channel that connects a hole to the outer contour ("keyhole") falls out (simple_loops); contours that occur twice
/// are taken once (drop_repeated).
///
/// Errors: UserError "name: …" where no contour is left, one is not planar or not parallel to the others, a point is
/// not finite or farther than kMostMm from the origin, a contour has over kMostContourPoints; plane_shapes'.
ContourStack stack_contours(std::span<const std::vector<Vec3>> contours, const std::string& name,
                            const ImageSlices& images = {});
inline constexpr double kOffPlaneMm = 0.3, kMostMm = 1e5;
inline constexpr std::size_t kMostContourPoints = 50'000;

/// Numbers of the planes of contours at these increasing heights, from 0 on. `is_alike(n, m)`: whether contours n and m
/// have about the same outline, so that they cannot be of one slice. See stack_contours.
std::vector<std::size_t> planes_of_heights(const std::vector<double>& heights, double image_spacing_mm,
                                           const std::function<bool(std::size_t, std::size_t)>& is_alike);

/// More than this many times the spacing, and the gaps beside it, is a gap that separates two pieces.
inline constexpr double kBridgedGap = 4.5;

}  // namespace brachy
