#include "core/solve/low_rank_term.h"

#include <algorithm>
#include <cassert>

#include <Eigen/Cholesky>

namespace brachy {

using Eigen::Index;

namespace {

using Rows = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>, 0,
                        Eigen::OuterStride<>>;

Rows rows_of(const double* data, std::size_t rows, std::size_t columns, std::size_t stride) {
  return {data, static_cast<Index>(rows), static_cast<Index>(columns),
          Eigen::OuterStride<>(static_cast<Index>(stride))};
}

}  // namespace

LowRankTerm::LowRankTerm(std::size_t max_landmarks, std::size_t max_columns, SimdTarget target)
    : loops_(inverse_loops(target)),
      stride_(InverseLoops::padded(max_columns)),
      projected_stride_(stride_ > 0 ? InverseLoops::padded(max_landmarks) : 0),
      W_(3 * max_landmarks * stride_),
      Z_(stride_ * projected_stride_),
      starts_(stride_),
      zeros_(projected_stride_) {
  R_.resize(static_cast<Index>(stride_), static_cast<Index>(stride_));
  gram_.resize(static_cast<Index>(projected_stride_), static_cast<Index>(projected_stride_));
  sums_.resize(static_cast<Index>(stride_));
}

void LowRankTerm::begin(std::size_t landmarks, std::size_t columns) noexcept {
  assert(takes(columns));
  rows_ = 3 * landmarks;
  columns_ = columns;
  std::fill_n(W_.begin(), rows_ * stride_, 0.0);
  std::ranges::fill(starts_, static_cast<std::uint32_t>(rows_));
}

void LowRankTerm::add(std::size_t landmark, std::size_t column, const Vec3& value) noexcept {
  for (std::size_t k = 0; k < 3; ++k)
    W_[(3 * landmark + k) * stride_ + column] = value[static_cast<Index>(k)];
  starts_[column] = std::min(starts_[column], static_cast<std::uint32_t>(3 * landmark));
}

void LowRankTerm::factor(const PanelMatrix& L) noexcept {
  // The loops take them as ascending.
  for (std::size_t c = columns_; c-- > 1;) starts_[c - 1] = std::min(starts_[c - 1], starts_[c]);
  loops_.solve_panels(L, 0, rows_, starts_.data(), W_.data(), stride_, columns_);
  const auto r = static_cast<Index>(columns_);
  loops_.gram(W_.data(), stride_, rows_, starts_.data(), columns_, R_.data(),
              static_cast<std::size_t>(R_.outerStride()));
  Eigen::Ref<Eigen::MatrixXd> M = R_.topLeftCorner(r, r);
  M.diagonal().array() += 1;
  [[maybe_unused]] const auto info = Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(M).info();
  assert(info == Eigen::Success);  // its eigenvalues are 1 and more
}

void LowRankTerm::apply(double* y) noexcept {
  auto sums = sums_.head(static_cast<Index>(columns_));
  loops_.project(W_.data(), stride_, starts_.data(), columns_, y, rows_, sums_.data());
  const auto R = R_.topLeftCorner(sums.size(), sums.size()).triangularView<Eigen::Lower>();
  R.solveInPlace(sums);
  R.transpose().solveInPlace(sums);
  loops_.subtract(W_.data(), stride_, starts_.data(), columns_, sums_.data(), rows_, y);
}

// Z = YᵀX = R⁻¹ WᵀX.
void LowRankTerm::project(const double* X, std::size_t stride, const std::uint32_t* starts,
                          std::size_t columns) noexcept {
  loops_.product(W_.data(), stride_, starts_.data(), columns_, X, stride, starts, columns, rows_, Z_.data(),
                 projected_stride_);
  loops_.solve_lower(R_.data(), static_cast<std::size_t>(R_.outerStride()), columns_, zeros_.data(),
                     Z_.data(), projected_stride_, columns);
}

void LowRankTerm::subtract_gram(const double* X, std::size_t stride, const std::uint32_t* starts,
                                std::size_t columns, Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  project(X, stride, starts, columns);
  loops_.gram(Z_.data(), projected_stride_, columns_, zeros_.data(), columns, gram_.data(),
              static_cast<std::size_t>(gram_.outerStride()));
  for (Index j = 0; j < H.cols(); ++j) H.col(j).tail(H.rows() - j) -= gram_.col(j).segment(j, H.rows() - j);
}

void LowRankTerm::subtract_squares(const double* X, std::size_t stride, const std::uint32_t* starts,
                                   std::size_t columns, std::span<double> squares) noexcept {
  project(X, stride, starts, columns);
  const auto Z = rows_of(Z_.data(), columns_, columns, projected_stride_);
  for (std::size_t c = 0; c < columns; ++c) squares[c] -= Z.col(static_cast<Index>(c)).squaredNorm();
}

}  // namespace brachy
