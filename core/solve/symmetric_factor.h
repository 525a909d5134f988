#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/base/rigid_transform.h"
#include "core/base/work_budget.h"
#include "core/solve/inverse_block.h"
#include "core/solve/low_rank_term.h"
#include "core/solve/panel_inverse.h"
#include "core/solve/panel_loops.h"

namespace brachy {

/// The Cholesky factor L of a symmetric positive definite matrix K, three rows a landmark, that is given again in every
/// tick. Of few rows (SpeedThresholds) it is Eigen's. Of more it is made of panels (panel_loops.h), and only from the
/// first row on in which K is another than in the last tick: so landmarks that rest should come first. What changes in
/// every tick with few columns U is added to K as U Uᵀ (LowRankTerm). Either way the result depends on K and U alone,
/// to the bit.
/// Threads: one. Real-time: no allocation after construction, no exceptions.
class SymmetricFactor {
 public:
  /// For at most `max_landmarks` landmarks, of which as many move together as one (rigid_stiffness), and so many added
  /// columns.
  SymmetricFactor(std::size_t max_landmarks, SimdTarget target, std::size_t max_columns = 0);

  /// K of so many landmarks, whose lower triangle is to be filled.
  Eigen::Ref<Eigen::MatrixXd> begin(std::size_t landmarks) noexcept;
  /// Whether so many columns can be added to the K of so many landmarks. They are filled in before `factor`, and K
  /// without them stays factored.
  bool takes(std::size_t landmarks, std::size_t columns) const {
    return static_cast<Eigen::Index>(3 * landmarks) >= SpeedThresholds::kPanelRows && added_.takes(columns);
  }
  LowRankTerm& add_columns(std::size_t columns, double norm) noexcept;
  /// Instead of begin: K is as it was factored last, without columns. Only where `keeps` says so.
  void begin_again() noexcept;
  bool keeps(std::size_t landmarks) const {
    return is_by_panels() && known_ == static_cast<Eigen::Index>(3 * landmarks) && known_ == n_;
  }
  /// Factors what was filled. False: K is not positive definite; call begin before anything else.
  bool factor() noexcept;
  /// Of K, 1-norm, estimated (norm_estimate.h). After factor. With columns: (‖K‖ + ‖U Uᵀ‖) ‖K⁻¹‖, more than it can be.
  double condition() noexcept;

  /// x = K⁻¹ x, one vector a landmark.
  void solve(std::span<Vec3> x) noexcept;
  /// H_ij = axes_i · (K⁻¹)_ij axes_j of the landmarks first … first + m − 1.
  void project(std::size_t first, std::span<const Vec3> axes, Eigen::Ref<Eigen::MatrixXd> H) noexcept;
  /// stiffness_g = vᵀK⁻¹v with v the `motions` of the group's landmarks: `group_of` each, or kNoGroup. Groups are
  /// numbered in the order of their first landmarks.
  void rigid_stiffness(std::span<const std::uint32_t> group_of, std::span<const Vec3> motions,
                       std::span<double> stiffness) noexcept;
  static constexpr std::uint32_t kNoGroup = ~0u;
  static constexpr std::size_t kMaxGroups = 32;

 private:
  bool is_by_panels() const { return n_ >= SpeedThresholds::kPanelRows; }
  Eigen::Ref<Eigen::MatrixXd> matrix() { return matrices_[current_].topLeftCorner(n_, n_); }
  Eigen::Index first_change() const noexcept;
  bool factor_panels() noexcept;
  PanelMatrix panels() noexcept { return {columns_.data(), first_columns_.data(), inverse_diagonal_.data()}; }
  PanelVectors vectors() noexcept { return {{planes_[0].data(), planes_[1].data(), planes_[2].data()}}; }

  const PanelLoops& loops_;
  Eigen::Index n_ = 0;
  double norm_ = 0, added_norm_ = 0;
  double inverse_norm_ = 0;  // of K by panels; 0: not known yet
  bool is_again_ = false;
  std::array<Eigen::MatrixXd, 2> matrices_;  // K of this tick and of the last; by Eigen, K and then L
  std::size_t current_ = 0;
  Eigen::Index known_ = 0;  // rows of the other matrix that panels have
  Eigen::VectorXd solution_;
  Eigen::MatrixXd scratch_;  // n × 3
  InverseBlock inverse_block_;

  std::vector<PanelColumn> columns_;
  std::vector<int> first_columns_;  // 0: panels are whole
  std::vector<double> inverse_diagonal_;
  std::array<std::vector<double>, PanelVectors::kCount> planes_;
  PanelInverse axial_, rigid_;
  LowRankTerm added_;
};

}  // namespace brachy
