#pragma once

#include <span>
#include <vector>

#include "core/geometry/surface/plane_section.h"

namespace brachy {

/// Areas of two regions of a plane, mm². Each is given by the edges of its outline and has the points from which a ray
/// crosses an odd number of them (even-odd rule).
struct RegionAreas {
  double first = 0, second = 0, both = 0;
};

/// The areas of two regions and of their intersection, exact to rounding: between the heights of corners and crossings
/// the lengths inside are linear. About (n + crossings) · n steps for n edges.
RegionAreas region_areas(std::span<const PlaneEdge> first, std::span<const PlaneEdge> second);

/// Distances from one outline to another: of points on `from`, in the middle of pieces of at most `step_mm`, to the
/// nearest point of `to`.
struct OutlineDistance {
  double distance_mm;
  double weight_mm;  ///< the piece's length
};
void add_outline_distances(std::span<const PlaneEdge> from, std::span<const PlaneEdge> to, double step_mm,
                           std::vector<OutlineDistance>& distances);

/// The distance that a share of the outline's length, 0 … 1, does not pass; 1: the largest. 0 of none. Sorts.
double distance_quantile(std::vector<OutlineDistance>& distances, double share);

}  // namespace brachy
