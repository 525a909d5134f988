#include "core/solve/per_landmark_support.h"

#include <cassert>
#include <limits>

namespace brachy {
namespace {

double norm(const Eigen::MatrixXd& matrix) {
  return matrix.cwiseAbs().colwise().sum().maxCoeff();
}

}  // namespace

FactorStatus PerLandmarkSystem::factorize(std::span<const Vec3> positions, std::span<const double> supports) {
  assert(supports.size() == positions.size());
  positions_.clear();
  supports_.clear();
  weights_.clear();
  condition_ = positions.empty() ? 1 : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (!positions[i].allFinite()) return {FactorStatus::kNotFinite, static_cast<int>(i)};
  if (positions.empty()) return {};

  const auto n = static_cast<Eigen::Index>(positions.size());
  Eigen::MatrixXd K(n, n);
  std::visit(
      [&](auto psi) {
        for (Eigen::Index j = 0; j < n; ++j)
          for (Eigen::Index i = 0; i < n; ++i) {
            const auto at = static_cast<std::size_t>(j);
            K(i, j) =
                psi.value((positions[static_cast<std::size_t>(i)] - positions[at]).norm() / supports[at]);
          }
      },
      kernel_);
  factor_.compute(K);
  // LU factorization does not report a singular matrix: a pivot of 0 makes the inverse infinite.
  if (factor_.matrixLU().diagonal().cwiseAbs().minCoeff() > 0) condition_ = norm(K) * norm(factor_.inverse());
  if (const FactorStatus status = FactorStatus::of_condition(condition_); !status) return status;
  positions_.assign(positions.begin(), positions.end());
  supports_.assign(supports.begin(), supports.end());
  return {};
}

void PerLandmarkSystem::solve(std::span<const Vec3> displacements, std::span<Vec3> weights) {
  assert(displacements.size() == positions_.size() && weights.size() == positions_.size());
  const auto n = static_cast<Eigen::Index>(positions_.size());
  Eigen::MatrixXd x(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) x.row(i) = displacements[static_cast<std::size_t>(i)].transpose();
  if (n > 0) x = factor_.solve(x).eval();
  for (Eigen::Index i = 0; i < n; ++i) weights[static_cast<std::size_t>(i)] = x.row(i).transpose();
  weights_.assign(weights.begin(), weights.end());
}

Vec3 PerLandmarkSystem::displacement(const Vec3& X) const {
  return std::visit(
      [&](auto psi) {
        Vec3 u = Vec3::Zero();
        for (std::size_t j = 0; j < weights_.size(); ++j)
          u += psi.value((X - positions_[j]).norm() / supports_[j]) * weights_[j];
        return u;
      },
      kernel_);
}

Mat3 PerLandmarkSystem::deformation_gradient(const Vec3& X) const {
  return std::visit(
      [&](auto psi) {
        Mat3 F = Mat3::Identity();
        for (std::size_t j = 0; j < weights_.size(); ++j) {
          const Vec3 x = (X - positions_[j]) / supports_[j];
          F += psi.derivative_over_r(x.norm()) / supports_[j] * weights_[j] * x.transpose();
        }
        return F;
      },
      kernel_);
}

}  // namespace brachy
