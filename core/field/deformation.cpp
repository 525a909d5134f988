#include "core/field/deformation.h"

#include <algorithm>
#include <cassert>

namespace brachy {
namespace {

constexpr std::uint64_t kColumnsForPair =
    6;  // column multiply-adds in the time of one direct pair, out of cache
constexpr std::size_t kColumnsAtOnce =
    3;  // columns of K⁻¹ a tick: they cost as much as the solve for weights

}  // namespace

Deformation::Deformation(const Tissue& tissue, Kernel kernel, double support_radius,
                         const BlockField::Options& options, double landmark_stiffness_n_per_mm)
    : landmark_stiffness_(landmark_stiffness_n_per_mm),
      system_(kernel, support_radius, static_cast<int>(options.max_landmarks), options.target),
      inverse_block_(options.max_landmarks, options.max_landmarks, options.target),
      blocks_(tissue, kernel, support_radius, options),
      field_{kernel, support_radius, {}, {}},
      cells_(kernel, support_radius, options.target, options.max_landmarks) {
  const std::size_t n = options.max_landmarks;
  for (auto* v : {&placed_, &positions_, &displacements_, &weights_, &moving_displacements_}) v->reserve(n);
  moving_.reserve(n);
  inverse_columns_.reserve(n * n);
}

FactorStatus Deformation::place(std::span<const Vec3> positions, std::span<const double> /*cores*/) noexcept {
  if (is_factored_ && std::ranges::equal(positions, placed_)) return {};
  FactorStatus status = system_.refactorize(positions);  // the tip, last, moves alone
  const double condition = status ? system_.condition() : 0;
  if (status) status = FactorStatus::of_condition(condition);
  is_factored_ = static_cast<bool>(status);
  if (!status) return status;
  condition_ = condition;
  placed_.assign(positions.begin(), positions.end());
  return {};
}

FactorStatus Deformation::update(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                                 std::span<const double> /*cores*/) noexcept {
  if (const FactorStatus status = place(positions); !status) return status;
  const bool same_positions = has_field_ && std::ranges::equal(positions, positions_);
  if (same_positions && std::ranges::equal(displacements, displacements_)) {
    evaluation_ = Evaluation::kIdle;
    return {};
  }
  if (!same_positions) {
    has_field_ = true;
    positions_.assign(positions.begin(), positions.end());
    blocks_.set_landmarks(positions_);
    restart();
  }
  displacements_.assign(displacements.begin(), displacements.end());
  if (same_positions) advance_condensing();
  compute_weights();
  blocks_.evaluate(weights_, moving_displacements_);

  const FieldStatistics& s = blocks_.statistics();
  evaluation_ = s.condensed_blocks == 0                  ? Evaluation::kDirect
                : s.condensed_blocks == s.touched_blocks ? Evaluation::kCondensed
                                                         : Evaluation::kMixed;
  field_.positions = positions_;
  field_.weights = weights_;
  return {};
}

void Deformation::reactions(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept {
  assert(is_factored_);
  system_.solve(displacements, forces);
  for (Vec3& f : forces) f *= landmark_stiffness_;
}

void Deformation::axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                                  Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  assert(is_factored_ && first + axes.size() <= placed_.size());
  system_.scale_inverse(first, axes, inverse_block_, H);
  H *= landmark_stiffness_;
}

double Deformation::total_force_n() const {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& w : weights_) sum += w;
  return landmark_stiffness_ * sum.norm();
}

void Deformation::rescale(double scale) noexcept {
  for (auto* vectors : {&weights_, &displacements_, &moving_displacements_})
    for (Vec3& v : *vectors) v *= scale;
  blocks_.evaluate(weights_, moving_displacements_);
}

void Deformation::restart() noexcept {
  settled_ticks_ = 0;
  columns_done_ = 0;
  is_condensing_ = has_columns_ = is_complete_ = false;
  moving_displacements_.clear();
}

bool Deformation::moves_within_columns() const noexcept {
  std::size_t k = 0;
  for (std::uint32_t j = 0; j < displacements_.size(); ++j) {
    if (k < moving_.size() && moving_[k] == j)
      ++k;
    else if (displacements_[j] != Vec3::Zero())
      return false;
  }
  return true;
}

void Deformation::choose_moving() noexcept {
  moving_.clear();
  for (std::uint32_t j = 0; j < displacements_.size(); ++j)
    if (displacements_[j] != Vec3::Zero()) moving_.push_back(j);
}

bool Deformation::is_condensable() const noexcept {
  const std::uint64_t condensed = blocks_.reachable_points() * moving_.size() / kColumnsForPair;
  return blocks_.can_condense(moving_.size()) && 2 * condensed < blocks_.reachable_pairs();
}

// One tick's share of the way from direct to condensed.
void Deformation::advance_condensing() noexcept {
  ++settled_ticks_;
  if (is_condensing_ && !moves_within_columns()) {
    blocks_.set_landmarks(positions_);
    restart();
  }
  if (!is_condensing_) {
    if (settled_ticks_ < kSettleTicks) return;
    choose_moving();
    if (!is_condensable()) return;
    is_condensing_ = true;
    inverse_columns_.resize(positions_.size() * moving_.size());
  }
  const std::size_t m = moving_.size();
  if (!has_columns_) {
    const std::size_t count = std::min(kColumnsAtOnce, m - columns_done_);
    system_.solve_columns(std::span(moving_).subspan(columns_done_, count),
                          inverse_columns_.data() + columns_done_, m);
    columns_done_ += count;
    has_columns_ = columns_done_ == m;
    if (has_columns_) blocks_.begin_condensing(inverse_columns_, m);
    return;
  }
  if (!is_complete_) is_complete_ = !blocks_.condense(std::max<std::uint64_t>(1, blocks_.reachable_pairs()));
}

void Deformation::compute_weights() noexcept {
  weights_.resize(positions_.size());
  moving_displacements_.clear();
  if (!has_columns_) {
    system_.solve(displacements_, weights_);
    return;
  }
  const std::size_t m = moving_.size();
  for (const std::uint32_t j : moving_) moving_displacements_.push_back(displacements_[j]);
  for (std::size_t j = 0; j < weights_.size(); ++j) {
    Vec3 w = Vec3::Zero();
    for (std::size_t k = 0; k < m; ++k) w += inverse_columns_[j * m + k] * moving_displacements_[k];
    weights_[j] = w;
  }
}

}  // namespace brachy
