#pragma once

#include <span>
#include <vector>

#include <Eigen/Cholesky>

#include "core/kernels/matrix_kernel.h"
#include "core/solve/rbf_system.h"

namespace brachy {

/// Whether landmarks at `positions` (n, mm) are finite and more than `distance` mm apart: kNotFinite or
/// kDuplicate name the
/// first that is not.
/// Real-time: does not allocate.
FactorStatus check_landmarks(std::span<const Vec3> positions, double distance) noexcept;

/// Landmarks solved with a matrix-valued kernel, exactly and in double: factorize the landmarks, solve for the forces,
/// evaluate anywhere. `brachy deform` uses it; the daemon's ticks use MatrixKernelField.
/// Threads: one. It allocates.
class MatrixKernelSystem {
 public:
  /// The kernel must outlive this.
  explicit MatrixKernelSystem(const MatrixKernel& kernel) : kernel_(kernel) {}

  /// Assembles and factors K for landmarks at rest positions (n, mm); those at the very same place are
  /// duplicates. Unless it returns kOk, there are no landmarks.
  FactorStatus factorize(std::span<const Vec3> positions, std::span<const double> cores = {});

  /// The landmarks' forces, N, that displace them by `displacements` (n, mm).
  std::vector<Vec3> solve(std::span<const Vec3> displacements) const;

  /// u at the points X, mm, of the landmarks' `forces` (n, N).
  std::vector<Vec3> evaluate(std::span<const Vec3> X, std::span<const Vec3> forces) const;

  /// det(I + ∇u) at the points X by central differences over 2·10⁻³ mm; ≤ 0 where the field folds.
  std::vector<double> jacobians(std::span<const Vec3> X, std::span<const Vec3> forces) const;

  std::size_t size() const { return groups_.size(); }
  /// Of K, 1-norm, estimated from below; of what was last factorized. 1 for no landmarks.
  double condition() const { return condition_; }
  const Eigen::MatrixXd& matrix() const { return matrix_; }  ///< K, 3n × 3n, mm/N

 private:
  const MatrixKernel& kernel_;
  PointGroups groups_;
  Eigen::MatrixXd matrix_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  double condition_ = 1;
};

}  // namespace brachy
