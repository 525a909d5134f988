#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/kernels/kernels.h"
#include "core/solve/factor_status.h"
#include "core/solve/inverse_block.h"
#include "core/solve/landmark_factor.h"
#include "core/solve/sweep_order.h"

namespace brachy {

/// The landmark system K α = d with K_ij = ψ(|p_i − p_j| / a), solved by Cholesky in double (paper, section 2.1;
/// u(p_i) = d_i = q_i − p_i and φ = 0). K is positive definite for distinct landmarks, one common a, dimension ≤ 3.
///
/// Phases: factorize(positions), then solve(displacements) as often as they change; RbfField evaluates. One landmark
/// is added by append and removed by remove, O(n²); refactorize detects what changed. Of many landmarks
/// (SpeedThresholds), where the support leaves enough of K empty, rows are ordered by a sweep and only their envelope
/// is stored and computed; that is decided from the landmarks alone. The same calls give the same bits on one SIMD
/// target.
/// Threads: one. Real-time: no allocation after construction at any n ≤ capacity; no exceptions.
class RbfSystem {
 public:
  /// When K is factored within its envelope. kNever and kAlways are for measurements and tests.
  enum class Sparse : std::uint8_t { kAuto, kNever, kAlways };

  /// `support_radius` a in mm, > 0; `capacity`: the most landmarks there will be. Memory: 4 capacity² B and a little.
  RbfSystem(Kernel kernel, double support_radius, int capacity, SimdTarget target = best_simd_target(),
            Sparse sparse = Sparse::kAuto);

  /// Assembles and factors K for `positions` (n points, mm). Unless it returns kOk, there are no landmarks.
  FactorStatus factorize(std::span<const Vec3> positions) noexcept;

  /// The same for a set that may begin like the last one: the leading landmarks that are equal keep their rows. With a
  /// dense factor the result is that of factorize bit for bit; with a sparse one it differs by rounding.
  FactorStatus refactorize(std::span<const Vec3> positions) noexcept;

  /// Adds landmark n < capacity (mm): a bordered update, O(n²). Unless it returns kOk, the factor is as it was. With a
  /// dense factor from factorize, the result is that of factorizing all of them, bit for bit. A sparse factor keeps it
  /// last, where its row is long, until the next factorize.
  FactorStatus append(const Vec3& position) noexcept;

  /// Removes landmark `index`, O(n²); those after it move up by one. Cannot fail: it is done by rotations, and K
  /// without a landmark is no worse conditioned than with it. Other bits than factorizing the rest, unless it was the
  /// last.
  void remove(int index) noexcept;

  /// weights = K⁻¹ displacements (both n, mm).
  void solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept;

  /// Columns of K⁻¹: columns[j · stride + k] = (K⁻¹)_{j, landmarks[k]}, j < n. Three cost as much as a solve.
  void solve_columns(std::span<const std::uint32_t> landmarks, double* columns, std::size_t stride) noexcept;

  /// H_ij = (K⁻¹)_ij (axes_i · axes_j) of the landmarks first … first + m − 1 (`axes` m, H m × m). `block`: of at
  /// least as many rows as there are landmarks, and m columns.
  void scale_inverse(std::size_t first, std::span<const Vec3> axes, InverseBlock& block,
                     Eigen::Ref<Eigen::MatrixXd> H) noexcept;

  /// K's condition number in the 1-norm, estimated from below, rarely below half of it (norm_estimate.h); 1 for no
  /// landmarks. Costs as much as four solves: 0.03 ms at n = 141, which is a factorisation, a fifth of one at
  /// n = 1000. So it is not part of factorize: callers that use the solution check FactorStatus::of_condition first.
  double condition() noexcept { return factor_.condition(); }

  int size() const { return static_cast<int>(positions_.size()); }
  bool is_sparse() const { return is_sparse_; }  ///< the factor is an envelope in the order of a sweep

 private:
  void clear() noexcept;
  bool prefers_sparse(std::span<const Vec3> positions) noexcept;
  FactorStatus factor_rows(int first_row) noexcept;
  FactorStatus find_duplicate() const noexcept;

  double support_radius_;
  Sparse sparse_;
  SweepOrder sweep_;
  LandmarkFactor factor_;
  std::vector<Vec3> positions_;
  std::vector<int> row_of_;  // of each landmark in the factor
  bool is_sparse_ = false;
};

}  // namespace brachy
