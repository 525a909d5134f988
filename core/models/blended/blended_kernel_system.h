#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/models/blended/membership.h"
#include "core/models/blended/tissue_kernels.h"
#include "core/solve/factor_status.h"
#include "core/solve/inverse_block.h"

namespace brachy {

/// Landmarks in tissues of different supports: K α = d with K_ij = Σ_m w_m(p_i) w_m(p_j) C_m(p_i − p_j),
/// positive definite for any distinct landmarks (membership.h; each term is a Schur product of positive
/// semidefinite matrices, and a landmark has some w_m > 0), by a dense Cholesky in double. The paper's rule,
/// a support for each landmark, ψ(|p_i − p_j|/a_j), is not.
///
/// Phases: factorize(positions), then solve(displacements) as often as they change; HeterogeneousField evaluates.
/// Kernels: ScalarKernels (α in mm) or CompactKernels (α in N).
/// Threads: one. Real-time: no allocation after construction at any n ≤ capacity; no exceptions.
template <class Kernels>
class BlendedKernelSystem {
 public:
  /// The model must outlive this. `capacity`: the most landmarks there will be.
  BlendedKernelSystem(const TissueModel<Kernels>& model, std::size_t capacity,
                      SimdTarget target = best_simd_target());

  /// Assembles and factors K for `positions` (n, mm). Unless it returns kOk, there are no landmarks.
  /// Landmarks nearer than FactorStatus::kDuplicateDistance of the largest support are duplicates; above
  /// kMaxCondition factorize fails.
  FactorStatus factorize(std::span<const Vec3> positions) noexcept;

  /// weights = K⁻¹ displacements (both n, mm).
  void solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept;

  /// H_ij = axes_i · (K⁻¹)_ij axes_j of the landmarks first … first + m − 1 (`axes` m, H m × m).
  void project_inverse(std::size_t first, std::span<const Vec3> axes, Eigen::Ref<Eigen::MatrixXd> H) noexcept;

  std::size_t size() const { return size_; }
  /// Of K, 1-norm, estimated from below; of what was last factorized, infinity where it could not be. 1 for
  /// no landmarks.
  double condition() const { return condition_; }
  /// w_m(p_i), n rows of tissues.
  std::span<const double> shares() const { return std::span(shares_).first(size_ * model_.kernels.size()); }

 private:
  FactorStatus find_unfit() const noexcept;
  void update_shares(std::span<const Vec3> positions) noexcept;
  void assemble() noexcept;

  const TissueModel<Kernels>& model_;
  double duplicate_distance_;
  std::size_t size_ = 0;
  std::vector<Vec3> positions_;  // whose shares_ are known, factored or not
  std::vector<double> shares_;
  Eigen::MatrixXd matrix_;   // K's lower triangle, then its factor
  Eigen::MatrixXd scratch_;  // three columns, for the condition number and right-hand sides
  InverseBlock inverse_block_;
  double condition_ = 1;
};

/// The displacement field u(X) = Σ_m w_m(X) Σ_i C_m(X − p_i) w_m(p_i) α_i at single points, in double: exact and plain.
/// Threads: const functions from any. Real-time: no allocation.
template <class Kernels>
struct HeterogeneousField {
  const TissueModel<Kernels>* model;
  std::span<const Vec3> positions;  ///< p, n landmarks at rest, mm
  std::span<const double> shares;   ///< w_m(p_i), n rows of tissues
  std::span<const Vec3> weights;    ///< α, n (from BlendedKernelSystem::solve)

  Vec3 displacement(const Vec3& X) const noexcept;  ///< mm
  /// I + ∇u(X), ∇u = Σ_m [u_m ∇w_mᵀ + w_m ∇u_m] with u_m the inner sum.
  Mat3 deformation_gradient(const Vec3& X) const noexcept;
  /// det(I + ∇u(X)): the local volume ratio; ≤ 0 where the field folds.
  double jacobian(const Vec3& X) const noexcept { return deformation_gradient(X).determinant(); }
};

extern template class BlendedKernelSystem<ScalarKernels>;
extern template class BlendedKernelSystem<CompactKernels>;
extern template struct HeterogeneousField<ScalarKernels>;
extern template struct HeterogeneousField<CompactKernels>;

}  // namespace brachy
