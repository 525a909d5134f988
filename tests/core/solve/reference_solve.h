#pragma once

#include <vector>

#include "core/solve/rbf_system.h"
#include "tests/core/kernels/kernel_formulas.h"

namespace brachy::test {

/// K⁻¹ d by Gaussian elimination in long double, without pivoting: K is positive definite.
inline std::vector<Vec3> reference_solve(const Kernel& kernel, double a, const std::vector<Vec3>& p,
                                         const std::vector<Vec3>& d) {
  using Row = Eigen::Matrix<Real, 3, 1>;
  const KernelFormula& psi = formula_of(name_of(kernel));
  const std::size_t n = p.size();
  std::vector<std::vector<Real>> K(n, std::vector<Real>(n));
  std::vector<Row> x(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = d[i].cast<Real>();
    for (std::size_t j = 0; j < n; ++j)
      K[i][j] = reference_psi(psi, (p[i].cast<Real>() - p[j].cast<Real>()).norm() / a);
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
