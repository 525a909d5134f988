#pragma once

#include <cmath>
#include <numbers>

#include "core/base/rigid_transform.h"

namespace brachy {

/// The displacement of an unbounded elastic solid of shear modulus 1 under a unit force spread over a small ball
/// (regularised Kelvin solution; core/DESIGN.md, section 3; R. Cortez, SIAM J. Sci. Comput. 23 (2001) 1204
/// for the way of spreading):
///
///     G(x) = 1/(4π) [ (1−b)/r_ε I + b xxᵀ/r_ε³ + s/(2r_ε³) I ],   b = 1/(4(1−ν)),   r_ε² = |x|² + s
///
/// s = s_i + s_j, mm², is the sum of what both ends contribute: c²/2 for a landmark of core radius c, 0 for a
/// point that is only looked at. Positive definite for any set of distinct points and any s_i > 0. Unit:
/// 1/(N/mm² · mm) per N.
inline Mat3 kelvin(const Vec3& x, double s, double poisson) {
  const double b = 1 / (4 * (1 - poisson));
  const double r2 = x.squaredNorm() + s, i1 = 1 / std::sqrt(r2), i3 = i1 / r2;
  constexpr double kShare = 1 / (4 * std::numbers::pi);
  Mat3 G = kShare * b * i3 * (x * x.transpose());
  G.diagonal().array() += kShare * ((1 - b) * i1 + 0.5 * s * i3);
  return G;
}

/// ∇(G(x) f): row i, column j is ∂(G f)_i/∂x_j; 1/(N/mm² · mm²) per N.
inline Mat3 kelvin_gradient(const Vec3& x, double s, double poisson, const Vec3& f) {
  const double b = 1 / (4 * (1 - poisson));
  const double r2 = x.squaredNorm() + s, i1 = 1 / std::sqrt(r2), i3 = i1 / r2, i5 = i3 / r2, dot = x.dot(f);
  Mat3 A = -((1 - b) * i3 + 1.5 * s * i5) * f * x.transpose() + b * i3 * x * f.transpose() -
           3 * b * i5 * dot * x * x.transpose();
  A.diagonal().array() += b * i3 * dot;
  return A / (4 * std::numbers::pi);
}

}  // namespace brachy
