#pragma once

#include <span>
#include <vector>

#include <Eigen/LU>

#include "core/base/rigid_transform.h"
#include "core/kernels/kernels.h"
#include "core/solve/factor_status.h"

namespace brachy {

/// The paper's treatment of heterogeneous tissue (section 5): every landmark has a support radius of its own,
/// K_ij = ψ(|p_i − p_j| / a_j), u(X) = Σ α_j ψ(|X − p_j| / a_j). K is not symmetric then, and nothing keeps
/// it regular: three landmarks in a line, h apart, with radii 4h, 11.660167858376596 h and 4h are exactly
/// singular for ψ3,1 (core/DESIGN.md, section 2). Kept for comparison, without optimisations; for positive
/// definite heterogeneous kernels see core/DESIGN.md, section 2.
/// Threads: const functions may be called from any. It allocates.
class PerLandmarkSystem {
 public:
  explicit PerLandmarkSystem(const Kernel& kernel) : kernel_(kernel) {}

  /// Assembles and factors K by LU with partial pivoting for landmarks at `positions` (n, mm) with
  /// `supports` (n, mm, > 0). kIllConditioned where condition() is above the bound. Unless it returns kOk,
  /// there are no landmarks.
  FactorStatus factorize(std::span<const Vec3> positions, std::span<const double> supports);

  /// ‖K‖₁ ‖K⁻¹‖₁ of what was last factorized, from the inverse itself; infinity where a pivot is 0. 1 for no landmarks.
  double condition() const { return condition_; }

  /// weights = K⁻¹ displacements (both n, mm), which the field below then has.
  void solve(std::span<const Vec3> displacements, std::span<Vec3> weights);

  /// u(X), mm; exactly zero farther from every landmark than its support.
  Vec3 displacement(const Vec3& X) const;
  /// I + ∇u(X). At a landmark of ψ3,0, which has a cusp there, its own term is left out.
  Mat3 deformation_gradient(const Vec3& X) const;

 private:
  Kernel kernel_;
  std::vector<Vec3> positions_, weights_;
  std::vector<double> supports_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factor_;
  double condition_ = 1;
};

}  // namespace brachy
