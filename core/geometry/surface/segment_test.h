#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/rigid_transform.h"

namespace brachy {

/// A segment's box test (slabs) and triangle test (Woop et al. 2013: shear the segment onto an axis, then three
/// edge functions in the plane). The segment is a + t d, d ≠ 0 and finite. Real-time: no allocation, no exception.
class SegmentTest {
 public:
  SegmentTest(const Vec3& a, const Vec3& d) : a_(a) {
    d.cwiseAbs().maxCoeff(&kz_);
    kx_ = (kz_ + 1) % 3;
    ky_ = (kx_ + 1) % 3;
    if (d[kz_] < 0) std::swap(kx_, ky_);  // keeps the winding
    shear_x_ = d[kx_] / d[kz_];
    shear_y_ = d[ky_] / d[kz_];
    scale_z_ = 1 / d[kz_];
    for (int k = 0; k < 3; ++k) {
      parallel_[k] = std::abs(d[k]) <= 1e-18 * std::abs(d[kz_]);  // moves less than the boxes' padding
      inverse_[k] = parallel_[k] ? 0 : 1 / d[k];
    }
  }

  /// The t at which the segment enters the box, or +inf where it misses it within [t_min, t_max].
  double box(const Vec3& min, const Vec3& max, double t_min, double t_max) const {
    for (int k = 0; k < 3; ++k) {
      if (parallel_[k]) {
        if (a_[k] < min[k] || a_[k] > max[k]) return std::numeric_limits<double>::infinity();
        continue;
      }
      const double t1 = (min[k] - a_[k]) * inverse_[k], t2 = (max[k] - a_[k]) * inverse_[k];
      t_min = std::max(t_min, std::min(t1, t2));
      t_max = std::min(t_max, std::max(t1, t2));
    }
    return t_min <= t_max ? t_min : std::numeric_limits<double>::infinity();
  }

  /// Whether the segment's line crosses the triangle p, q, r; sets t and whether it goes against its normal.
  bool triangle(const Vec3& p, const Vec3& q, const Vec3& r, double& t, bool& entering) const {
    const Vec3 a = sheared(p), b = sheared(q), c = sheared(r);
    int side_u, side_v, side_w;
    const double u = edge(c, b, side_u), v = edge(a, c, side_v);
    if (side_u != side_v) return false;
    const double w = edge(b, a, side_w);
    if (side_w != side_u || side_u == 0) return false;
    t = (u * a.z() + v * b.z() + w * c.z()) / (u + v + w);
    entering = side_u > 0;
    return true;
  }

 private:
  /// Depends on the corner and the segment only, so that triangles that share a corner get the same value.
  Vec3 sheared(const Vec3& corner) const {
    const Vec3 p = corner - a_;
    return {p[kx_] - shear_x_ * p[kz_], p[ky_] - shear_y_ * p[kz_], scale_z_ * p[kz_]};
  }

  /// p × q in the plane, and its exact sign: of two products the one that rounds to the larger number is larger;
  /// where both round to the same number, their rounding errors decide. An exact 0 takes the sign for corners shifted
  /// by (ε, ε²), the same for every triangle, so that the segment crosses the projected surface in general position.
  static double edge(const Vec3& p, const Vec3& q, int& side) {
    const double left = p.x() * q.y(), right = p.y() * q.x();
    double value = left - right;
    if (left == right) value = std::fma(p.x(), q.y(), -left) - std::fma(p.y(), q.x(), -right);
    side = sign(value);
    if (side == 0) side = sign(q.y() - p.y());
    if (side == 0) side = sign(p.x() - q.x());
    return value;
  }
  static int sign(double x) { return (x > 0) - (x < 0); }

  Vec3 a_, inverse_;
  bool parallel_[3];
  int kx_, ky_, kz_ = 0;
  double shear_x_, shear_y_, scale_z_;
};

}  // namespace brachy
