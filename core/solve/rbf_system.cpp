#include "core/solve/rbf_system.h"

#include <algorithm>
#include <cassert>

#include "core/base/work_budget.h"

namespace brachy {
namespace {

FactorStatus check_finite(std::span<const Vec3> positions) {
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (!positions[i].allFinite()) return {FactorStatus::kNotFinite, static_cast<int>(i), -1};
  return {};
}

}  // namespace

RbfSystem::RbfSystem(Kernel kernel, double support_radius, int capacity, SimdTarget target, Sparse sparse)
    : support_radius_(support_radius),
      sparse_(sparse),
      sweep_(assembly_loops(kernel, target), capacity),
      factor_(kernel, target, support_radius, capacity) {
  positions_.reserve(static_cast<std::size_t>(capacity));
  row_of_.reserve(static_cast<std::size_t>(capacity));
}

void RbfSystem::clear() noexcept {
  factor_.truncate(0);
  positions_.clear();
  row_of_.clear();
}

bool RbfSystem::prefers_sparse(std::span<const Vec3> positions) noexcept {
  if (sparse_ == Sparse::kNever || positions.empty()) return false;
  if (sparse_ == Sparse::kAuto && static_cast<int>(positions.size()) < SpeedThresholds::kSparseLandmarks)
    return false;
  sweep_.compute(positions, support_radius_);
  return sparse_ == Sparse::kAlways || sweep_.fill_estimate() < SpeedThresholds::kSparseFill;
}

FactorStatus RbfSystem::factorize(std::span<const Vec3> positions) noexcept {
  clear();
  assert(positions.size() <= positions_.capacity());
  if (const FactorStatus status = check_finite(positions); !status) return status;
  positions_.assign(positions.begin(), positions.end());
  row_of_.resize(positions.size());
  is_sparse_ = prefers_sparse(positions);
  for (std::size_t row = 0; row < positions.size(); ++row) {
    const auto landmark = is_sparse_ ? static_cast<std::size_t>(sweep_.order()[row]) : row;
    row_of_[landmark] = static_cast<int>(row);
    factor_.push_back(positions[landmark], is_sparse_ ? sweep_.first_neighbours()[row] : 0);
  }
  return factor_rows(0);
}

FactorStatus RbfSystem::refactorize(std::span<const Vec3> positions) noexcept {
  assert(positions.size() <= positions_.capacity());
  if (const FactorStatus status = check_finite(positions); !status) {
    clear();
    return status;
  }
  const auto differ = std::ranges::mismatch(positions, positions_);
  const auto kept = static_cast<int>(differ.in1 - positions.begin());
  const int n = static_cast<int>(positions.size()), changes = size() - kept + n - kept;
  const bool few = is_sparse_ ? changes <= SpeedThresholds::kSparseChanges : kept >= n / 2;
  if (!few && (is_sparse_ || n >= SpeedThresholds::kSparseLandmarks)) return factorize(positions);

  if (is_sparse_) {
    while (size() > kept) remove(size() - 1);
    for (int i = kept; i < n; ++i)
      if (const FactorStatus status = append(positions[static_cast<std::size_t>(i)]); !status) {
        clear();
        return status;
      }
    return {};
  }
  factor_.truncate(kept);
  positions_.assign(positions.begin(), positions.end());
  row_of_.resize(positions.size());
  for (int row = kept; row < n; ++row) {
    row_of_[static_cast<std::size_t>(row)] = row;
    factor_.push_back(positions[static_cast<std::size_t>(row)], 0);
  }
  return factor_rows(kept);
}

FactorStatus RbfSystem::factor_rows(int first_row) noexcept {
  const double duplicate = FactorStatus::kDuplicateDistance * support_radius_;
  FactorStatus status;
  if (factor_.assemble(first_row) < duplicate * duplicate)
    status = find_duplicate();
  else if (!factor_.factor(first_row))
    status = {FactorStatus::kNotPositiveDefinite, -1, -1};
  if (!status) clear();
  return status;
}

// Finds the pair; called only once duplicates are known to exist.
FactorStatus RbfSystem::find_duplicate() const noexcept {
  const double least = FactorStatus::kDuplicateDistance * support_radius_;
  for (std::size_t j = 0; j < positions_.size(); ++j)
    for (std::size_t i = j + 1; i < positions_.size(); ++i)
      if ((positions_[i] - positions_[j]).squaredNorm() < least * least)
        return {FactorStatus::kDuplicate, static_cast<int>(j), static_cast<int>(i)};
  return {FactorStatus::kNotPositiveDefinite, -1, -1};
}

FactorStatus RbfSystem::append(const Vec3& position) noexcept {
  assert(positions_.size() < positions_.capacity());
  const int n = size();
  if (!position.allFinite()) return {FactorStatus::kNotFinite, n, -1};
  for (int i = 0; i < n; ++i)
    if ((positions_[static_cast<std::size_t>(i)] - position).norm() <
        FactorStatus::kDuplicateDistance * support_radius_)
      return {FactorStatus::kDuplicate, i, n};
  if (!factor_.append(position, is_sparse_ ? factor_.first_neighbour(position) : 0))
    return {FactorStatus::kNotPositiveDefinite, -1, -1};
  positions_.push_back(position);
  row_of_.push_back(n);
  return {};
}

void RbfSystem::remove(int index) noexcept {
  assert(index >= 0 && index < size());
  const int row = row_of_[static_cast<std::size_t>(index)];
  if (row == size() - 1)
    factor_.truncate(row);
  else
    factor_.remove(row);
  positions_.erase(positions_.begin() + index);
  row_of_.erase(row_of_.begin() + index);
  for (int& r : row_of_)
    if (r > row) --r;
}

void RbfSystem::solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept {
  assert(displacements.size() == positions_.size() && weights.size() == positions_.size());
  const PanelVectors v = factor_.vectors();
  for (std::size_t i = 0; i < displacements.size(); ++i)
    for (int c = 0; c < 3; ++c) v.plane[c][row_of_[i]] = displacements[i][c];
  factor_.solve();
  for (std::size_t i = 0; i < weights.size(); ++i)
    for (int c = 0; c < 3; ++c) weights[i][c] = v.plane[c][row_of_[i]];
}

void RbfSystem::solve_columns(std::span<const std::uint32_t> landmarks, double* columns,
                              std::size_t stride) noexcept {
  constexpr std::size_t kCount = PanelVectors::kCount;
  const PanelVectors v = factor_.vectors();
  for (std::size_t k = 0; k < landmarks.size(); k += kCount) {
    const std::size_t count = std::min(kCount, landmarks.size() - k);
    for (double* plane : v.plane) std::fill_n(plane, positions_.size(), 0.0);
    int first = size();
    for (std::size_t c = 0; c < count; ++c) {
      const int row = row_of_[landmarks[k + c]];
      v.plane[c][row] = 1;
      first = std::min(first, row);
    }
    factor_.solve(first);
    for (std::size_t j = 0; j < positions_.size(); ++j)
      for (std::size_t c = 0; c < count; ++c) columns[j * stride + k + c] = v.plane[c][row_of_[j]];
  }
}

// L⁻¹ of unit vectors, three at a time, in the order of the factor's rows.
void RbfSystem::scale_inverse(std::size_t first, std::span<const Vec3> axes, InverseBlock& block,
                              Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  constexpr std::size_t kCount = PanelVectors::kCount;
  const std::size_t n = positions_.size();
  const PanelVectors v = factor_.vectors();
  block.begin(n, axes.size());
  for (std::size_t k = 0; k < axes.size(); k += kCount) {
    const std::size_t count = std::min(kCount, axes.size() - k);
    for (double* plane : v.plane) std::fill_n(plane, n, 0.0);
    int start = size();
    for (std::size_t c = 0; c < count; ++c) {
      const int row = row_of_[first + k + c];
      v.plane[c][row] = 1;
      block.set_start(k + c, static_cast<std::size_t>(row));
      start = std::min(start, row);
    }
    factor_.solve_lower(start);
    for (auto row = static_cast<std::size_t>(start); row < n; ++row)
      for (std::size_t c = 0; c < count; ++c) block.row(row)[k + c] = v.plane[c][row];
  }
  block.finish_scaled(axes, H);
}

}  // namespace brachy
