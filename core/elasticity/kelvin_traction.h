#pragma once

#include "core/elasticity/kelvin.h"

namespace brachy {

/// The traction on the plane of unit normal `n` at x of the force at the origin, σ(G) n of kelvin.h: entry (i, j)
/// is its component i for a force along j, 1/mm² per N. With c = b/r_ε³, a = −1/r_ε³ − 3s/(2r_ε⁵), e = 3b/r_ε⁵ and
/// λ/μ = 2ν/(1−2ν), from ∂_k G_ij = 1/(4π) [ (a+c) δ_ij x_k + c δ_ik x_j + c δ_jk x_i − e x_i x_j x_k ]:
///
///     σn = 1/(4π) [ (a+2c) ((x·n) I + x nᵀ) + 2c n xᵀ − 2e (x·n) x xᵀ + λ/μ (a + 5c − e|x|²) n xᵀ ]
///
/// 0 at x = 0. Does not depend on the shear modulus; ν < ½.
inline Mat3 kelvin_traction(const Vec3& x, const Vec3& n, double s, double poisson) {
  constexpr double kShare = 1 / (4 * std::numbers::pi);
  const double b = 1 / (4 * (1 - poisson)), lambda = 2 * poisson / (1 - 2 * poisson);
  const double r2 = x.squaredNorm(), i2 = 1 / (r2 + s), i3 = i2 * std::sqrt(i2), i5 = i3 * i2;
  const double a = -i3 - 1.5 * s * i5, c = b * i3, e = 3 * b * i5, xn = x.dot(n);
  Mat3 T = (a + 2 * c) * (x * n.transpose()) - (2 * e * xn) * (x * x.transpose()) +
           (2 * c + lambda * (a + 5 * c - e * r2)) * (n * x.transpose());
  T.diagonal().array() += (a + 2 * c) * xn;
  return kShare * T;
}

}  // namespace brachy
