#include "core/models/matrix_kernel/matrix_kernel_system.h"

#include <limits>

#include "core/solve/matrix_condition.h"

namespace brachy {
namespace {

Eigen::VectorXd stacked(std::span<const Vec3> vectors) {
  Eigen::VectorXd all(static_cast<Eigen::Index>(3 * vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); ++i)
    all.segment<3>(static_cast<Eigen::Index>(3 * i)) = vectors[i];
  return all;
}

std::vector<Vec3> unstacked(const Eigen::VectorXd& all) {
  std::vector<Vec3> vectors(static_cast<std::size_t>(all.size()) / 3);
  for (std::size_t i = 0; i < vectors.size(); ++i)
    vectors[i] = all.segment<3>(static_cast<Eigen::Index>(3 * i));
  return vectors;
}

}  // namespace

FactorStatus check_landmarks(std::span<const Vec3> positions, double distance) noexcept {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!positions[i].allFinite()) return {FactorStatus::kNotFinite, static_cast<int>(i)};
    for (std::size_t j = 0; j < i; ++j)
      if ((positions[i] - positions[j]).squaredNorm() <= distance * distance)
        return {FactorStatus::kDuplicate, static_cast<int>(j), static_cast<int>(i)};
  }
  return {};
}

FactorStatus MatrixKernelSystem::factorize(std::span<const Vec3> positions, std::span<const double> cores) {
  groups_.clear();
  condition_ = std::numeric_limits<double>::infinity();
  if (const FactorStatus status = check_landmarks(positions, 0); !status) return status;
  PointGroups groups = kernel_.groups(positions, cores);
  matrix_ = kernel_.between(groups, groups);
  matrix_ = 0.5 * (matrix_ + matrix_.transpose()).eval();
  factor_.compute(matrix_);
  if (factor_.info() != Eigen::Success) return {FactorStatus::kNotPositiveDefinite};
  Eigen::MatrixXd scratch(matrix_.rows(), 3);
  condition_ = positions.empty()
                   ? 1
                   : symmetric_norm(matrix_, scratch.col(0)) * inverse_norm(factor_.matrixLLT(), scratch);
  if (const FactorStatus status = FactorStatus::of_condition(condition_); !status) return status;
  groups_ = std::move(groups);
  return {};
}

std::vector<Vec3> MatrixKernelSystem::solve(std::span<const Vec3> displacements) const {
  return unstacked(factor_.solve(stacked(displacements)));
}

std::vector<Vec3> MatrixKernelSystem::evaluate(std::span<const Vec3> X, std::span<const Vec3> forces) const {
  return unstacked(kernel_.fields(X, groups_, stacked(forces)));
}

std::vector<double> MatrixKernelSystem::jacobians(std::span<const Vec3> X,
                                                  std::span<const Vec3> forces) const {
  // Rounding leaves 1e-12 mm over the step, curvature a sixth of its square of the third derivative.
  constexpr double kStep = 1e-3;  // mm
  std::vector<Vec3> shifted;
  shifted.reserve(6 * X.size());
  for (const Vec3& x : X)
    for (int k = 0; k < 3; ++k)
      for (const double step : {kStep, -kStep}) shifted.push_back(x + step * Vec3::Unit(k));
  const std::vector<Vec3> u = evaluate(shifted, forces);
  std::vector<double> det;
  det.reserve(X.size());
  for (std::size_t i = 0; i < X.size(); ++i) {
    Mat3 F = Mat3::Identity();
    for (int k = 0; k < 3; ++k) {
      const std::size_t at = 6 * i + 2 * static_cast<std::size_t>(k);
      F.col(k) += (u[at] - u[at + 1]) / (2 * kStep);
    }
    det.push_back(F.determinant());
  }
  return det;
}

}  // namespace brachy
