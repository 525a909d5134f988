#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// How a point's force is spread (kelvin.h), and with what s two points see each other: the sum of theirs.
struct PointCore {
  double s = 0;         ///< mm²
  double smooth_s = 0;  ///< the same as the smooth part of a kernel sees it (elastic_kernel.h)
  double self_s = 0;    ///< with itself

  /// A force spread with core radius c on one of many points that make up a surface: s = c²/2, for each of a pair.
  static PointCore of_surface(double s) { return {s, s, 2 * s}; }
  /// A landmark of core radius c alone: all that is not itself is seen as points, with c². So the field of its force goes
  /// through every landmark as K has it. K stays positive definite: with 2c² for itself it would be a Gram matrix, and
  /// c² only adds to its diagonal.
  static PointCore of_landmark(double c) { return {c * c, 0, c * c}; }

  bool operator==(const PointCore&) const = default;
};

/// Landmarks as a matrix-valued kernel sees them: each is a few points that share one force, by `weights`, and whose
/// displacement is observed as the same weighted sum. So a landmark keeps three unknowns however many points it is made
/// of, and the kernel between groups is as positive definite as it is between points.
struct PointGroups {
  std::vector<Vec3> points;  ///< at rest, mm
  std::vector<double> s;     ///< of each point's core, as the two below
  std::vector<double> smooth_s;
  std::vector<double> self_s;
  std::vector<double> weights;       ///< of each point in its group; they usually sum to 1
  std::vector<std::uint32_t> first;  ///< group g: points first[g] … first[g + 1] − 1; size n + 1

  std::size_t size() const { return first.empty() ? 0 : first.size() - 1; }
  void clear() {
    points.clear();
    s.clear();
    smooth_s.clear();
    self_s.clear();
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
    self_s.push_back(core.self_s);
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
