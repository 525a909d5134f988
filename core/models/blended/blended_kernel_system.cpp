#include "core/models/blended/blended_kernel_system.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

#include <Eigen/Cholesky>

#include "core/solve/matrix_condition.h"

namespace brachy {
namespace {

constexpr Eigen::Index index(std::size_t i) {
  return static_cast<Eigen::Index>(i);
}

}  // namespace

template <class Kernels>
BlendedKernelSystem<Kernels>::BlendedKernelSystem(const TissueModel<Kernels>& model, std::size_t capacity,
                                                  SimdTarget target)
    : model_(model), inverse_block_(Kernels::kRows * capacity, capacity, target) {
  const Kernels& kernels = model.kernels;
  assert(model.membership.tissues() == kernels.size());
  duplicate_distance_ = FactorStatus::kDuplicateDistance * model.largest_support();
  positions_.reserve(capacity);
  shares_.reserve(capacity * kernels.size());
  const auto rows = index(Kernels::kRows * capacity);
  matrix_.resize(rows, rows);
  scratch_.resize(rows, 3);
}

template <class Kernels>
FactorStatus BlendedKernelSystem<Kernels>::factorize(std::span<const Vec3> positions) noexcept {
  assert(positions.size() <= positions_.capacity());
  size_ = 0;
  condition_ = positions.empty() ? 1 : std::numeric_limits<double>::infinity();
  update_shares(positions);
  if (const FactorStatus status = find_unfit(); !status) return status;
  if (positions.empty()) return {};
  assemble();
  const auto n = index(Kernels::kRows * positions.size());
  Eigen::Ref<Eigen::MatrixXd> K = matrix_.topLeftCorner(n, n);
  const double norm = symmetric_norm(K, scratch_.col(0).head(n));
  if (Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(K).info() != Eigen::Success)
    return {FactorStatus::kNotPositiveDefinite, -1, -1};
  condition_ = norm * inverse_norm(K, scratch_.topRows(n));
  if (const FactorStatus status = FactorStatus::of_condition(condition_); !status) return status;
  size_ = positions.size();
  return {};
}

// A landmark that stays keeps its shares: a mesh's distance costs microseconds.
template <class Kernels>
void BlendedKernelSystem<Kernels>::update_shares(std::span<const Vec3> positions) noexcept {
  const std::size_t M = model_.kernels.size(), known = positions_.size();
  positions_.resize(positions.size());
  shares_.resize(positions.size() * M);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (i < known && positions_[i] == positions[i]) continue;
    positions_[i] = positions[i];
    model_.membership.shares(positions[i], std::span(shares_).subspan(i * M, M));
  }
}

template <class Kernels>
FactorStatus BlendedKernelSystem<Kernels>::find_unfit() const noexcept {
  const double least = duplicate_distance_ * duplicate_distance_;
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (!positions_[i].allFinite()) return {FactorStatus::kNotFinite, static_cast<int>(i), -1};
    for (std::size_t j = 0; j < i; ++j)
      if ((positions_[i] - positions_[j]).squaredNorm() < least)
        return {FactorStatus::kDuplicate, static_cast<int>(j), static_cast<int>(i)};
  }
  return {};
}

template <class Kernels>
void BlendedKernelSystem<Kernels>::assemble() noexcept {
  constexpr Eigen::Index kRows = Kernels::kRows;
  const std::size_t n = positions_.size(), M = model_.kernels.size();
  matrix_.topLeftCorner(kRows * index(n), kRows * index(n)).setZero();
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t i = j; i < n; ++i) {
      const Vec3 x = positions_[i] - positions_[j];
      auto K = matrix_.block<kRows, kRows>(kRows * index(i), kRows * index(j));
      for (std::size_t m = 0; m < M; ++m) {
        const double w = shares_[i * M + m] * shares_[j * M + m];
        if (w == 0) continue;
        if constexpr (kRows == 1)
          K(0, 0) += w * model_.kernels.value(m, x);
        else
          K += w * model_.kernels.value(m, x);
      }
    }
}

template <class Kernels>
void BlendedKernelSystem<Kernels>::solve(std::span<const Vec3> displacements,
                                         std::span<Vec3> weights) noexcept {
  assert(displacements.size() == size_ && weights.size() == size_);
  if (size_ == 0) return;
  const auto n = index(Kernels::kRows * size_);
  const auto L = matrix_.topLeftCorner(n, n).template triangularView<Eigen::Lower>();
  auto x = scratch_.col(0).head(n);
  // Components that share one matrix one by one: several right-hand sides at a time allocate (core/DESIGN.md,
  // section 7).
  for (int c = 0; c < 3 / Kernels::kRows; ++c) {
    for (std::size_t i = 0; i < size_; ++i)
      x.template segment<Kernels::kRows>(Kernels::kRows * index(i)) =
          displacements[i].segment<Kernels::kRows>(c);
    L.solveInPlace(x);
    L.transpose().solveInPlace(x);
    for (std::size_t i = 0; i < size_; ++i)
      weights[i].segment<Kernels::kRows>(c) = x.template segment<Kernels::kRows>(Kernels::kRows * index(i));
  }
}

template <class Kernels>
void BlendedKernelSystem<Kernels>::project_inverse(std::size_t first, std::span<const Vec3> axes,
                                                   Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  assert(first + axes.size() <= size_);
  const auto n = index(Kernels::kRows * size_);
  if constexpr (Kernels::kRows == 1)
    inverse_block_.scale(matrix_.topLeftCorner(n, n), first, axes, H);
  else
    inverse_block_.project(matrix_.topLeftCorner(n, n), first, axes, H);
}

template <class Kernels>
Vec3 HeterogeneousField<Kernels>::displacement(const Vec3& X) const noexcept {
  const std::size_t M = model->kernels.size();
  std::array<double, Membership::kMaxTissues> w;
  model->membership.shares(X, std::span(w).first(M));
  Vec3 u = Vec3::Zero();
  for (std::size_t m = 0; m < M; ++m) {
    if (w[m] == 0) continue;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const double share = w[m] * shares[i * M + m];
      if (share != 0) u += share * (model->kernels.value(m, X - positions[i]) * weights[i]);
    }
  }
  return u;
}

template <class Kernels>
Mat3 HeterogeneousField<Kernels>::deformation_gradient(const Vec3& X) const noexcept {
  const std::size_t M = model->kernels.size();
  std::array<double, Membership::kMaxTissues> w;
  std::array<Vec3, Membership::kMaxTissues> slopes;
  model->membership.shares(X, std::span(w).first(M), std::span(slopes).first(M));
  Mat3 F = Mat3::Identity();
  for (std::size_t m = 0; m < M; ++m) {
    if (w[m] == 0) continue;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const double share = shares[i * M + m];
      if (share == 0) continue;
      const Vec3 x = X - positions[i], f = share * weights[i];
      F += model->kernels.value(m, x) * f * slopes[m].transpose() + w[m] * model->kernels.gradient(m, x, f);
    }
  }
  return F;
}

template class BlendedKernelSystem<ScalarKernels>;
template class BlendedKernelSystem<CompactKernels>;
template struct HeterogeneousField<ScalarKernels>;
template struct HeterogeneousField<CompactKernels>;

}  // namespace brachy
