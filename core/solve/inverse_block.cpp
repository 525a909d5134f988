#include "core/solve/inverse_block.h"

#include <algorithm>
#include <cassert>

namespace brachy {

InverseBlock::InverseBlock(std::size_t max_rows, std::size_t max_columns, SimdTarget target)
    : loops_(inverse_loops(target)), X_(max_rows * InverseLoops::padded(max_columns)), starts_(max_columns) {}

void InverseBlock::begin(std::size_t rows, std::size_t columns) noexcept {
  assert(columns <= starts_.size() && rows * InverseLoops::padded(columns) <= X_.size());
  rows_ = rows;
  columns_ = columns;
  stride_ = InverseLoops::padded(columns);
  std::fill_n(X_.data(), rows_ * stride_, 0.0);
}

// Rows of L before the first landmark's are not needed: X is zero there.
void InverseBlock::project(const Eigen::Ref<const Eigen::MatrixXd>& L, std::size_t first,
                           std::span<const Vec3> axes, Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  const auto from = static_cast<Eigen::Index>(3 * first);
  begin(static_cast<std::size_t>(L.rows() - from), axes.size());
  for (std::size_t i = 0; i < axes.size(); ++i) {
    set_start(i, 3 * i);
    for (std::size_t k = 0; k < 3; ++k) row(3 * i + k)[i] = axes[i][static_cast<Eigen::Index>(k)];
  }
  solve(L, from);
  gram(H);
}

void InverseBlock::scale(const Eigen::Ref<const Eigen::MatrixXd>& L, std::size_t first,
                         std::span<const Vec3> axes, Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  const auto from = static_cast<Eigen::Index>(first);
  begin(static_cast<std::size_t>(L.rows() - from), axes.size());
  for (std::size_t i = 0; i < axes.size(); ++i) {
    set_start(i, i);
    row(i)[i] = 1;
  }
  solve(L, from);
  finish_scaled(axes, H);
}

void InverseBlock::finish_scaled(std::span<const Vec3> axes, Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  gram(H);
  for (std::size_t j = 0; j < columns_; ++j)
    for (std::size_t i = 0; i < columns_; ++i)
      H(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) *= axes[i].dot(axes[j]);
}

void InverseBlock::solve(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Index from) noexcept {
  if (columns_ == 0) return;
  loops_.solve_lower(L.data() + from * (L.outerStride() + 1), static_cast<std::size_t>(L.outerStride()),
                     rows_, starts_.data(), X_.data(), stride_, columns_);
}

void InverseBlock::gram(Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  assert(H.rows() == H.cols() && H.rows() == static_cast<Eigen::Index>(columns_));
  if (columns_ == 0) return;
  loops_.gram(X_.data(), stride_, rows_, starts_.data(), columns_, H.data(),
              static_cast<std::size_t>(H.outerStride()));
  for (Eigen::Index j = 0; j < H.cols(); ++j)
    for (Eigen::Index i = j + 1; i < H.rows(); ++i) H(j, i) = H(i, j);
}

}  // namespace brachy
