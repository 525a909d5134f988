#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "core/kernels/kernels.h"
#include "core/math/rigid_transform.h"

namespace brachy {

/// How factorize ended.
struct FactorStatus {
  enum Kind {
    kOk,
    kNotFinite,            ///< landmark `first` has a coordinate that is not finite
    kDuplicate,            ///< landmarks `first` and `second` are closer than kDuplicateDistance · a
    kNotPositiveDefinite,  ///< rounding has eaten the least eigenvalue: landmarks too close for this support
  } kind = kOk;
  int first = -1, second = -1;  ///< landmark indices, for kNotFinite and kDuplicate

  explicit operator bool() const { return kind == kOk; }
};

/// The landmark system K α = d with K_ij = ψ(|p_i − p_j| / a), solved by Cholesky in double (paper, section 2.1;
/// u(p_i) = d_i = q_i − p_i and φ = 0). K is positive definite for distinct landmarks, one common a, dimension ≤ 3.
///
/// Phases: factorize(positions), then solve(displacements) as often as they change; RbfField evaluates.
/// Threads: one. Real-time: no allocation after construction while n ≤ capacity ≤ 128; no exceptions.
class RbfSystem {
 public:
  /// Landmarks closer than this share of the support radius are duplicates, refused by name (DESIGN §4).
  static constexpr double kDuplicateDistance = 1e-6;

  /// `support_radius` a in mm, > 0; `capacity`: the most landmarks factorize will be given.
  RbfSystem(Kernel kernel, double support_radius, int capacity);

  /// Assembles and factors K for `positions` (n points, mm). Unless it returns kOk, solve must not be called.
  FactorStatus factorize(std::span<const Vec3> positions) noexcept;

  /// weights = K⁻¹ displacements (both n, mm), n as in the last factorize.
  void solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept;

 private:
  Kernel kernel_;
  double support_radius_;
  int n_ = 0;
  Eigen::MatrixXd K_;  // capacity × capacity; the top-left n × n holds the factor L
  Eigen::Matrix<double, Eigen::Dynamic, 3> rhs_;  // capacity × 3
};

}  // namespace brachy
