#include "core/solve/symmetric_factor.h"

#include <algorithm>
#include <cassert>

#include <Eigen/Cholesky>

#include "core/solve/matrix_condition.h"
#include "core/solve/norm_estimate.h"

namespace brachy {

using Eigen::Index;

namespace {

constexpr int kHigh = PanelMatrix::kRows;

int panels_of(Index rows) {
  return static_cast<int>((rows + kHigh - 1) / kHigh);
}

}  // namespace

SymmetricFactor::SymmetricFactor(std::size_t max_landmarks, SimdTarget target, std::size_t max_columns)
    : loops_(panel_loops(target)),
      inverse_block_(3 * max_landmarks, max_landmarks, target),
      axial_(3 * max_landmarks, max_landmarks, true, target),
      rigid_(3 * max_landmarks, kMaxGroups, false, target),
      added_(max_landmarks, max_columns, target) {
  const auto n = static_cast<Index>(3 * max_landmarks);
  for (Eigen::MatrixXd& K : matrices_) K.resize(n, n);
  solution_.resize(n);
  scratch_.resize(n, 3);
  const int panels = panels_of(n);
  columns_.resize(PanelMatrix::panel_begin(panels));
  first_columns_.assign(static_cast<std::size_t>(panels), 0);
  const auto padded = static_cast<std::size_t>(kHigh * panels);
  inverse_diagonal_.resize(padded);
  for (std::vector<double>& plane : planes_) plane.resize(padded);
}

Eigen::Ref<Eigen::MatrixXd> SymmetricFactor::begin(std::size_t landmarks) noexcept {
  n_ = static_cast<Index>(3 * landmarks);
  assert(n_ <= matrices_[0].rows());
  added_.clear();
  added_norm_ = 0;
  is_again_ = false;
  return matrix();
}

LowRankTerm& SymmetricFactor::add_columns(std::size_t columns, double norm) noexcept {
  assert(takes(static_cast<std::size_t>(n_) / 3, columns));
  added_.begin(static_cast<std::size_t>(n_) / 3, columns);
  added_norm_ = norm;
  return added_;
}

void SymmetricFactor::begin_again() noexcept {
  assert(keeps(static_cast<std::size_t>(n_) / 3));
  added_.clear();
  added_norm_ = 0;
  is_again_ = true;
}

bool SymmetricFactor::factor() noexcept {
  if (n_ == 0) return true;
  if (is_again_) {
    if (!added_.is_empty()) added_.factor(panels());
    return true;
  }
  auto K = matrix();
  norm_ = symmetric_norm(K, scratch_.col(0).head(n_));
  if (is_by_panels()) return factor_panels();
  known_ = 0;
  return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(K).info() == Eigen::Success;
}

// The first row in which K is not what panels have.
Index SymmetricFactor::first_change() const noexcept {
  const Eigen::MatrixXd &now = matrices_[current_], &last = matrices_[1 - current_];
  Index first = std::min(n_, known_);
  for (Index j = 0; j < first; ++j) {
    const double* a = &now.coeffRef(j, j);
    first = j + (std::mismatch(a, a + (first - j), &last.coeffRef(j, j)).first - a);
  }
  return first;
}

bool SymmetricFactor::factor_panels() noexcept {
  const auto K = matrix();
  const PanelMatrix L = panels();
  const int begin = static_cast<int>(first_change()) / kHigh, end = panels_of(n_);
  for (PanelInverse* inverse : {&axial_, &rigid_})
    inverse->forget_from(static_cast<std::size_t>(begin * kHigh));
  for (int I = begin; I < end; ++I) {
    const Index row = I * kHigh, rows = std::min<Index>(kHigh, n_ - row);
    for (Index j = 0; j < row + kHigh; ++j) {
      double* to = L.panel(I)[j].row;
      const Index above = std::clamp<Index>(j - row, 0, kHigh);  // of the diagonal
      std::fill_n(to, kHigh, 0.0);
      if (above < rows) std::copy_n(&K.coeffRef(row + above, j), rows - above, to + above);
    }
  }
  known_ = 0;
  inverse_norm_ = 0;
  if (!loops_.factor(L, begin, end, static_cast<int>(n_))) return false;
  known_ = n_;
  current_ = 1 - current_;
  if (!added_.is_empty()) added_.factor(L);
  return true;
}

double SymmetricFactor::condition() noexcept {
  if (n_ == 0) return 1;
  if (!is_by_panels()) return norm_ * inverse_norm(matrix(), scratch_.topRows(n_));
  if (inverse_norm_ == 0) {
    const PanelVectors v = vectors();
    const auto n = static_cast<int>(n_);
    inverse_norm_ = estimate_inverse_norm(
        static_cast<std::size_t>(n_), v.plane, [&](std::size_t row) { return inverse_diagonal_[row]; },
        [&] {
          for (double* plane : v.plane) std::fill(plane + n, plane + kHigh * panels_of(n_), 0.0);
          loops_.forward(panels(), n, 0, v);
          loops_.backward(panels(), n, v);
        });
  }
  // What is added is positive semidefinite: the inverse's norm falls with it.
  return (norm_ + added_norm_) * inverse_norm_;
}

void SymmetricFactor::solve(std::span<Vec3> x) noexcept {
  assert(static_cast<Index>(3 * x.size()) == n_);
  if (x.empty()) return;
  if (!is_by_panels()) {
    auto all = solution_.head(n_);
    for (std::size_t l = 0; l < x.size(); ++l) all.segment<3>(static_cast<Index>(3 * l)) = x[l];
    const auto L = matrices_[current_].topLeftCorner(n_, n_).triangularView<Eigen::Lower>();
    L.solveInPlace(all);
    L.transpose().solveInPlace(all);
    for (std::size_t l = 0; l < x.size(); ++l) x[l] = all.segment<3>(static_cast<Index>(3 * l));
    return;
  }
  for (std::vector<double>& plane : planes_) std::fill_n(plane.begin(), kHigh * panels_of(n_), 0.0);
  for (std::size_t l = 0; l < x.size(); ++l) std::copy_n(x[l].data(), 3, &planes_[0][3 * l]);
  loops_.forward(panels(), static_cast<int>(n_), 0, vectors());
  if (!added_.is_empty()) added_.apply(planes_[0].data());
  loops_.backward(panels(), static_cast<int>(n_), vectors());
  for (std::size_t l = 0; l < x.size(); ++l) std::copy_n(&planes_[0][3 * l], 3, x[l].data());
}

void SymmetricFactor::project(std::size_t first, std::span<const Vec3> axes,
                              Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  if (!is_by_panels()) return inverse_block_.project(matrix(), first, axes, H);
  axial_.begin(static_cast<std::size_t>(n_) / 3, axes.size());
  for (std::size_t i = 0; i < axes.size(); ++i) axial_.set(first + i, i, axes[i]);
  axial_.solve(panels());
  axial_.gram(H);
  if (!added_.is_empty())
    added_.subtract_gram(axial_.data(), axial_.stride(), axial_.starts(), axes.size(), H);
  for (Index j = 0; j < H.cols(); ++j)
    for (Index i = j + 1; i < H.rows(); ++i) H(j, i) = H(i, j);
}

void SymmetricFactor::rigid_stiffness(std::span<const std::uint32_t> group_of, std::span<const Vec3> motions,
                                      std::span<double> stiffness) noexcept {
  if (stiffness.size() <= kMaxGroups && is_by_panels()) {
    rigid_.begin(group_of.size(), stiffness.size());
    for (std::size_t l = 0; l < group_of.size(); ++l)
      if (group_of[l] != kNoGroup) rigid_.set(l, group_of[l], motions[l]);
    rigid_.solve(panels());
    rigid_.squares(stiffness);
    if (!added_.is_empty())
      added_.subtract_squares(rigid_.data(), rigid_.stride(), rigid_.starts(), stiffness.size(), stiffness);
    return;
  }
  for (std::size_t g = 0; g < stiffness.size(); ++g) {
    auto x = solution_.head(n_);
    x.setZero();
    for (std::size_t l = 0; l < group_of.size(); ++l)
      if (group_of[l] == g) x.segment<3>(static_cast<Index>(3 * l)) = motions[l];
    matrices_[current_].topLeftCorner(n_, n_).triangularView<Eigen::Lower>().solveInPlace(x);
    stiffness[g] = x.squaredNorm();
  }
}

}  // namespace brachy
