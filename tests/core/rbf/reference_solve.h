#pragma once

#include <cmath>
#include <vector>

#include "core/rbf/rbf_system.h"

namespace brachy::test {

/// ψ(r) written out again, in long double.
inline long double reference_psi(const Kernel& kernel, long double r) {
  const std::string_view name = name_of(kernel);
  if (r >= 1) return 0;
  const long double t = 1 - r, r2 = r * r;
  if (name == "psi30") return t * t;
  if (name == "psi31") return t * t * t * t * (4 * r + 1);
  if (name == "psi32") return t * t * t * t * t * t * (35.0L / 3 * r2 + 6 * r + 1);
  return r > 0 ? r2 * (r2 * (12 * std::log(r) - 21) + 32 * r - 12) + 1 : 1;
}

/// K⁻¹ d by Gauss in long double, without pivoting: K is positive definite.
inline std::vector<Vec3> reference_solve(const Kernel& kernel, double a, const std::vector<Vec3>& p,
                                         const std::vector<Vec3>& d) {
  using Real = long double;
  using Row = Eigen::Matrix<Real, 3, 1>;
  const std::size_t n = p.size();
  std::vector<std::vector<Real>> K(n, std::vector<Real>(n));
  std::vector<Row> x(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = d[i].cast<Real>();
    for (std::size_t j = 0; j < n; ++j)
      K[i][j] = reference_psi(kernel, (p[i].cast<Real>() - p[j].cast<Real>()).norm() / a);
  }
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = k + 1; i < n; ++i) {
      const Real f = K[i][k] / K[k][k];
      for (std::size_t j = k; j < n; ++j) K[i][j] -= f * K[k][j];
      x[i] -= f * x[k];
    }
  std::vector<Vec3> weights(n);
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) x[k] -= K[k][j] * x[j];
    x[k] /= K[k][k];
    weights[k] = x[k].cast<double>();
  }
  return weights;
}

/// max |x_i − y_i| / max |y_i|
inline double relative_difference(const std::vector<Vec3>& x, const std::vector<Vec3>& y) {
  double difference = 0, largest = 1e-300;
  for (std::size_t i = 0; i < y.size(); ++i) {
    difference = std::max(difference, (x[i] - y[i]).norm());
    largest = std::max(largest, y[i].norm());
  }
  return difference / largest;
}

inline std::vector<Vec3> solve(RbfSystem& system, const std::vector<Vec3>& displacements) {
  std::vector<Vec3> weights(displacements.size());
  system.solve(displacements, weights);
  return weights;
}

}  // namespace brachy::test
