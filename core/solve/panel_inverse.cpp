#include "core/solve/panel_inverse.h"

#include <algorithm>
#include <cassert>

namespace brachy {

using Eigen::Index;

PanelInverse::PanelInverse(std::size_t max_rows, std::size_t max_columns, bool has_gram, SimdTarget target)
    : loops_(inverse_loops(target)),
      stride_(InverseLoops::padded(max_columns)),
      starts_(stride_, kNone),
      X_(max_rows * stride_) {
  for (auto* entries : {&entries_, &last_entries_}) entries->reserve(max_rows / 3);
  if (has_gram) sums_.resize(static_cast<Index>(max_columns), static_cast<Index>(max_columns));
}

void PanelInverse::begin(std::size_t landmarks, std::size_t columns) noexcept {
  assert(columns <= stride_);
  std::swap(entries_, last_entries_);
  entries_.assign(landmarks, {});
  rows_ = 3 * landmarks;
  columns_ = columns;
  std::ranges::fill(starts_, kNone);
}

void PanelInverse::set(std::size_t landmark, std::size_t column, const Vec3& v) noexcept {
  entries_[landmark] = {static_cast<std::uint32_t>(column), v};
  starts_[column] = std::min(starts_[column], static_cast<std::uint32_t>(3 * landmark));
}

void PanelInverse::solve(const PanelMatrix& L) noexcept {
  constexpr std::size_t kPanel = PanelMatrix::kRows;
  const auto differ = std::ranges::mismatch(entries_, last_entries_);
  const auto same = static_cast<std::size_t>(differ.in1 - entries_.begin());
  fresh_from_ = std::min({known_rows_, 3 * same, rows_}) / kPanel * kPanel;
  // What begins later is zero before; and columns that are no more would be summed.
  std::fill(X_.begin() + static_cast<std::ptrdiff_t>(fresh_from_ * stride_),
            X_.begin() + static_cast<std::ptrdiff_t>(rows_ * stride_), 0.0);
  for (std::size_t l = fresh_from_ / 3; l < entries_.size(); ++l)
    for (std::size_t k = 0; k < 3 && entries_[l].column != kNone; ++k)
      if (3 * l + k >= fresh_from_)
        X_[(3 * l + k) * stride_ + entries_[l].column] = entries_[l].v[static_cast<Index>(k)];
  loops_.solve_panels(L, fresh_from_, rows_, starts_.data(), X_.data(), stride_, columns_);
  if (fresh_from_ < summed_rows_) summed_rows_ = 0;
  known_rows_ = rows_;
}

// Rows that stayed are summed up once; the rest is added in every call.
void PanelInverse::gram(Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  assert(H.rows() == static_cast<Index>(columns_) && H.cols() == H.rows());
  const auto m = static_cast<Index>(columns_);
  const auto outer = static_cast<std::size_t>(sums_.outerStride());
  if (summed_rows_ == 0) summed_columns_ = 0;
  for (Index j = 0; j < m; ++j)
    sums_.col(j).head(m).tail(m - std::max(j, std::min(m, summed_columns_))).setZero();
  summed_columns_ = std::max(m, summed_columns_);
  loops_.add_gram(X_.data(), stride_, summed_rows_, fresh_from_, starts_.data(), columns_, sums_.data(),
                  outer);
  summed_rows_ = fresh_from_;
  for (Index j = 0; j < m; ++j) H.col(j).tail(m - j) = sums_.col(j).segment(j, m - j);
  loops_.add_gram(X_.data(), stride_, fresh_from_, rows_, starts_.data(), columns_, H.data(),
                  static_cast<std::size_t>(H.outerStride()));
}

void PanelInverse::squares(std::span<double> sums) const noexcept {
  std::fill_n(sums.begin(), columns_, 0.0);
  for (std::size_t row = 0; row < rows_; ++row)
    for (std::size_t c = 0; c < columns_; ++c) {
      const double x = X_[row * stride_ + c];
      sums[c] += x * x;
    }
}

}  // namespace brachy
