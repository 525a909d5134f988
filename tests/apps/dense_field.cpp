#include "tests/apps/dense_field.h"

#include <cmath>
#include <utility>

#include "tests/core/kernels/kernel_formulas.h"

namespace brachy::test {
namespace {

using Vec = DenseField::Vec;

Real distance(const Vec& a, const Vec& b) {
  Real sum = 0;
  for (int k = 0; k < 3; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

// A X = B with n right-hand rows of 3, by elimination with row pivoting.
std::vector<Vec> eliminate(std::vector<std::vector<Real>> A, std::vector<Vec> B) {
  const std::size_t n = B.size();
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; ++r)
      if (std::abs(A[r][c]) > std::abs(A[pivot][c])) pivot = r;
    std::swap(A[c], A[pivot]);
    std::swap(B[c], B[pivot]);
    for (std::size_t r = c + 1; r < n; ++r) {
      const Real factor = A[r][c] / A[c][c];
      for (std::size_t j = c; j < n; ++j) A[r][j] -= factor * A[c][j];
      for (int k = 0; k < 3; ++k) B[r][k] -= factor * B[c][k];
    }
  }
  for (std::size_t c = n; c-- > 0;)
    for (int k = 0; k < 3; ++k) {
      for (std::size_t j = c + 1; j < n; ++j) B[c][k] -= A[c][j] * B[j][k];
      B[c][k] /= A[c][c];
    }
  return B;
}

}  // namespace

DenseField::DenseField(std::string kernel, double support, std::vector<Landmark> landmarks)
    : kernel_(std::move(kernel)), support_(support), landmarks_(std::move(landmarks)) {
  const std::size_t n = landmarks_.size();
  std::vector<std::vector<Real>> K(n, std::vector<Real>(n));
  std::vector<Vec> d;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j)
      K[i][j] = reference_psi(formula_of(kernel_), distance(landmarks_[i].p, landmarks_[j].p) / support_);
    d.push_back(landmarks_[i].d);
  }
  weights_ = eliminate(std::move(K), std::move(d));
}

Vec DenseField::displacement(const Vec& x) const {
  Vec u{};
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const Real psi = reference_psi(formula_of(kernel_), distance(x, landmarks_[i].p) / support_);
    for (int k = 0; k < 3; ++k) u[k] += weights_[i][k] * psi;
  }
  return u;
}

Real DenseField::determinant(const Vec& x) const {
  Real F[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const Real length = distance(x, landmarks_[i].p);
    if (length == 0) continue;  // every C² kernel is flat there
    const Real gradient = reference_slope(formula_of(kernel_), length / support_) / (support_ * length);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) F[r][c] += weights_[i][r] * gradient * (x[c] - landmarks_[i].p[c]);
  }
  return F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) -
         F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0]) +
         F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]);
}

}  // namespace brachy::test
