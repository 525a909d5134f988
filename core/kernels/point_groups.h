#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// Landmarks as a matrix-valued kernel sees them: each is a few points that share one force, by `weights`, and whose
/// displacement is observed as the same weighted sum. So a landmark keeps three unknowns however many points it is made
/// of, and the kernel between groups is as positive definite as it is between points.
struct PointGroups {
  std::vector<Vec3> points;  ///< at rest, mm
  std::vector<double> s;     ///< c²/2 of each point, mm² (kelvin.h)
  std::vector<double>
      smooth_s;                 ///< the same as the smooth part of a kernel sees the point (elastic_kernel.h)
  std::vector<double> weights;  ///< of each point in its group; they usually sum to 1
  std::vector<std::uint32_t> first;  ///< group g: points first[g] … first[g + 1] − 1; size n + 1

  std::size_t size() const { return first.empty() ? 0 : first.size() - 1; }
  void clear() {
    points.clear();
    s.clear();
    smooth_s.clear();
    weights.clear();
    first.clear();
  }
  void begin_group() { first.push_back(static_cast<std::uint32_t>(points.size())); }
  void add(const Vec3& point, double s_point, double weight) { add(point, s_point, s_point, weight); }
  void add(const Vec3& point, double s_point, double smooth_s_point, double weight) {
    points.push_back(point);
    s.push_back(s_point);
    smooth_s.push_back(smooth_s_point);
    weights.push_back(weight);
  }
  void finish() { begin_group(); }  ///< after the last group

  /// Every point a group of its own, of weight 1.
  static PointGroups single(std::span<const Vec3> points, double s_point) {
    PointGroups groups;
    for (const Vec3& p : points) {
      groups.begin_group();
      groups.add(p, s_point, 1);
    }
    groups.finish();
    return groups;
  }
};

}  // namespace brachy
