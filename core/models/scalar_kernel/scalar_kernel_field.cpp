#include "core/models/scalar_kernel/scalar_kernel_field.h"

#include <algorithm>
#include <cassert>

#include "core/base/work_budget.h"

namespace brachy {

ScalarKernelField::ScalarKernelField(const Tissue& tissue, Kernel kernel, double support_radius,
                                     const BlockField::Options& options, double landmark_stiffness_n_per_mm)
    : TissueField({.max_landmarks = options.max_landmarks,
                   .force_scale = landmark_stiffness_n_per_mm}),  // ψ(0) = 1: of a weight of 1 mm
      system_(kernel, support_radius, static_cast<int>(options.max_landmarks), options.target),
      inverse_block_(options.max_landmarks, options.max_landmarks, options.target),
      blocks_(tissue, kernel, support_radius, options),
      field_{kernel, support_radius, {}, {}},
      cells_(kernel, support_radius, options.target, options.max_landmarks) {
  const std::size_t n = options.max_landmarks;
  moving_.reserve(n);
  moving_displacements_.reserve(n);
  inverse_columns_.reserve(n * n);
}

FactorStatus ScalarKernelField::do_factorize(const LandmarkSet& landmarks, double& condition) noexcept {
  const FactorStatus status = system_.refactorize(landmarks.positions);  // the tip, last, moves alone
  if (!status) return status;
  condition = system_.condition();
  return FactorStatus::of_condition(condition);
}

void ScalarKernelField::do_solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept {
  system_.solve(displacements, weights);
}

void ScalarKernelField::do_project_inverse(std::size_t first, std::span<const Vec3> axes,
                                           Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  system_.scale_inverse(first, axes, inverse_block_, H);
}

Evaluation ScalarKernelField::do_evaluate(bool is_new_set, std::span<Vec3> weights) noexcept {
  if (is_new_set) {
    blocks_.set_landmarks(positions());
    restart();
  } else {
    advance_condensing();
  }
  compute_weights(weights);
  blocks_.evaluate(weights, moving_displacements_);
  field_.positions = positions();
  field_.weights = weights;

  const FieldStatistics& s = blocks_.statistics();
  if (s.condensed_blocks == 0) return Evaluation::kDirect;
  return s.condensed_blocks == s.touched_blocks ? Evaluation::kCondensed : Evaluation::kMixed;
}

void ScalarKernelField::do_rescale(double scale) noexcept {
  for (Vec3& v : moving_displacements_) v *= scale;
  blocks_.evaluate(weights(), moving_displacements_);
}

void ScalarKernelField::restart() noexcept {
  settled_ticks_ = 0;
  columns_done_ = 0;
  shares_ = 0;
  is_condensing_ = has_columns_ = is_complete_ = false;
  moving_displacements_.clear();
}

bool ScalarKernelField::moves_within_columns() const noexcept {
  std::size_t k = 0;
  for (std::uint32_t j = 0; j < displacements().size(); ++j) {
    if (k < moving_.size() && moving_[k] == j)
      ++k;
    else if (displacements()[j] != Vec3::Zero())
      return false;
  }
  return true;
}

void ScalarKernelField::choose_moving() noexcept {
  moving_.clear();
  for (std::uint32_t j = 0; j < displacements().size(); ++j)
    if (displacements()[j] != Vec3::Zero()) moving_.push_back(j);
}

bool ScalarKernelField::is_condensable() const noexcept {
  const std::uint64_t condensed = blocks_.reachable_points() * moving_.size() / WorkCosts::kColumnsForPair;
  return blocks_.can_condense(moving_.size()) && 2 * condensed < blocks_.reachable_pairs();
}

// One tick's share of the work of changing from direct to condensed evaluation.
void ScalarKernelField::advance_condensing() noexcept {
  ++settled_ticks_;
  if (is_condensing_ && !moves_within_columns()) {
    blocks_.set_landmarks(positions());
    restart();
  }
  if (!is_condensing_) {
    if (settled_ticks_ < SpeedThresholds::kSettleTicks) return;
    choose_moving();
    if (!is_condensable()) return;
    is_condensing_ = true;
    inverse_columns_.resize(positions().size() * moving_.size());
  }
  if (!has_columns_) return add_columns();
  if (!is_complete_) condense_share();
}

void ScalarKernelField::condense_share() noexcept {
  is_complete_ = !blocks_.condense(std::max<std::uint64_t>(1, blocks_.reachable_pairs()));
  ++shares_;
}

void ScalarKernelField::add_columns() noexcept {
  const std::size_t m = moving_.size(), count = std::min(SpeedThresholds::kColumnsATick, m - columns_done_);
  system_.solve_columns(std::span(moving_).subspan(columns_done_, count),
                        inverse_columns_.data() + columns_done_, m);
  columns_done_ += count;
  has_columns_ = columns_done_ == m;
  if (has_columns_) blocks_.begin_condensing(inverse_columns_, m);
}

void ScalarKernelField::do_save(StateWriter& writer) const {
  writer(settled_ticks_, is_condensing_, moving_, columns_done_, shares_, moving_displacements_);
}

// Columns are not kept: they are made again in the same shares, so that they have the same bits.
void ScalarKernelField::do_restore(StateReader& reader) {
  std::size_t columns = 0;
  std::uint64_t shares = 0;
  reader(settled_ticks_, is_condensing_, moving_, columns, shares, moving_displacements_);
  inverse_columns_.resize(positions().size() * moving_.size());
  while (columns_done_ < columns) add_columns();
  while (shares_ < shares) condense_share();
  blocks_.evaluate(weights(), moving_displacements_);
}

void ScalarKernelField::compute_weights(std::span<Vec3> weights) noexcept {
  moving_displacements_.clear();
  if (!has_columns_) {
    system_.solve(displacements(), weights);
    return;
  }
  const std::size_t m = moving_.size();
  for (const std::uint32_t j : moving_) moving_displacements_.push_back(displacements()[j]);
  for (std::size_t j = 0; j < weights.size(); ++j) {
    Vec3 w = Vec3::Zero();
    for (std::size_t k = 0; k < m; ++k) w += inverse_columns_[j * m + k] * moving_displacements_[k];
    weights[j] = w;
  }
}

}  // namespace brachy
