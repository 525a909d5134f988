#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// How a point's force is spread (kelvin.h).
struct PointCore {
  double s = 0;              ///< mm²
  double smooth_s = 0;       ///< the same as the smooth part of a kernel sees it (elastic_kernel.h)
  bool is_landmark = false;  ///< a landmark of one point with a core of its own
  double counter_s = 0;      ///< mm², of the same force turned over, which takes it back; 0: none

  /// One of many points that make up a surface, of core radius c: s = c²/2, which adds up for each of a pair.
  static PointCore of_surface(double s) { return {s, s, false}; }
  /// A landmark of core radius c alone: s = c², because all else is seen as points. So the field of its force moves the
  /// tissue at every other landmark as K says.
  static PointCore of_landmark(double c) { return {c * c, 0, true}; }

  /// A force that displaces what is near and leaves none on the tissue as a whole: of core radius c, taken back over
  /// one twice as wide.
  static PointCore of_correction(double c) { return {c * c, 0, true, 4 * c * c}; }

  /// s of Kelvin's solution between the two. Between landmarks the wider core holds: for landmarks of one
  /// core the field goes through them all. K stays positive definite (core/DESIGN.md, section 3).
  static double between(double s_a, bool a_is_landmark, double s_b, bool b_is_landmark) {
    return a_is_landmark && b_is_landmark ? (s_a > s_b ? s_a : s_b) : s_a + s_b;
  }
  double with(const PointCore& other) const { return between(s, is_landmark, other.s, other.is_landmark); }

  bool operator==(const PointCore&) const = default;
};

/// Landmarks as a matrix-valued kernel sees them: each is a few points that share one force, by `weights`, and whose
/// displacement is observed as the same weighted sum. So a landmark keeps three unknowns however many points it is made
/// of, and the kernel between groups is as positive definite as it is between points.
struct PointGroups {
  std::vector<Vec3> points;  ///< at rest, mm
  std::vector<double> s;     ///< of each point's core, as the two below
  std::vector<double> smooth_s;
  std::vector<std::uint8_t> is_landmark;
  std::vector<double> weights;       ///< of each point in its group; they usually sum to 1
  std::vector<std::uint32_t> first;  ///< group g: points first[g] … first[g + 1] − 1; size n + 1

  std::size_t size() const { return first.empty() ? 0 : first.size() - 1; }
  void clear() {
    points.clear();
    s.clear();
    smooth_s.clear();
    is_landmark.clear();
    weights.clear();
    first.clear();
  }
  void begin_group() { first.push_back(static_cast<std::uint32_t>(points.size())); }
  void add(const Vec3& point, double s_point, double weight) {
    add(point, PointCore::of_surface(s_point), weight);
  }
  void add(const Vec3& point, const PointCore& core, double weight) {
    points.push_back(point);
    s.push_back(core.s);
    smooth_s.push_back(core.smooth_s);
    is_landmark.push_back(core.is_landmark ? 1 : 0);
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
