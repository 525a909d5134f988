#pragma once

#include <span>

#include <Eigen/Core>

#include "core/kernels/point_groups.h"

namespace brachy {

/// A matrix-valued deformation model: a positive definite matrix-valued kernel C(x, y), the displacement at x
/// (mm) by a force at y (N). MatrixKernelSystem solves landmarks with it; MatrixKernelField evaluates it at 200 Hz.
/// Threads: const functions may be called from any. They allocate.
class MatrixKernel {
 public:
  virtual ~MatrixKernel() = default;

  /// How the kernel sees landmarks at `positions` (n, mm); `cores`: core radius of each, mm, or 0 for the kernel's own
  /// rule; empty: its rule for all.
  virtual PointGroups groups(std::span<const Vec3> positions, std::span<const double> cores) const = 0;

  /// C between groups, 3|a| × 3|b|, mm/N.
  virtual Eigen::MatrixXd between(const PointGroups& a, const PointGroups& b) const = 0;

  /// Displacements at the points X, 3|X| × m in mm, of m sets of forces on groups b (3|b| × m, N).
  virtual Eigen::MatrixXd fields(std::span<const Vec3> X, const PointGroups& b,
                                 const Eigen::MatrixXd& forces) const = 0;

  /// Memory in use, bytes.
  virtual std::size_t bytes() const = 0;
};

}  // namespace brachy
