#include "core/solve/landmark_factor.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/solve/norm_estimate.h"

namespace brachy {
namespace {

constexpr int kRows = PanelMatrix::kRows, kStep = PanelMatrix::kColumnStep;

}  // namespace

LandmarkFactor::LandmarkFactor(const Kernel& kernel, SimdTarget target, double support_radius, int capacity)
    : assembly_(assembly_loops(kernel, target)),
      loops_(panel_loops(target)),
      support_radius_(support_radius) {
  assert(support_radius > 0 && capacity > 0);
  const std::size_t rows = at(panels(capacity)) * kRows;
  columns_.resize(PanelMatrix::panel_begin(panels(capacity)));
  first_neighbours_.resize(rows);
  for (auto* v : {&panel_begins_, &old_begins_}) v->resize(at(panels(capacity)));
  for (auto* v : {&inverse_diagonal_, &x_, &y_, &z_, &carry_, &column_}) v->resize(rows);
  planes_.resize(3 * rows);
  for (int row = 0; row < static_cast<int>(rows); ++row) place_out_of_reach(row);
}

void LandmarkFactor::place(int row, const Vec3& p) noexcept {
  x_[at(row)] = p.x();
  y_[at(row)] = p.y();
  z_[at(row)] = p.z();
}

// Beyond every support and every other row; the square of the distance is still finite.
void LandmarkFactor::place_out_of_reach(int row) noexcept {
  place(row, Vec3::Constant(1e140 * (row + 1)));
  first_neighbours_[at(row)] = row;
}

void LandmarkFactor::push_back(const Vec3& p, int first_neighbour) noexcept {
  assert(n_ < static_cast<int>(x_.size()) && first_neighbour <= n_);
  place(n_, p);
  first_neighbours_[at(n_)] = first_neighbour;
  ++n_;
}

void LandmarkFactor::truncate(int n) noexcept {
  assert(n >= 0 && n <= n_);
  for (int row = n; row < n_; ++row) place_out_of_reach(row);
  n_ = n;
  if (n % kRows == 0) return;
  const int I = n / kRows;
  PanelColumn* panel = matrix().panel(I);
  for (int j = panel_begins_[at(I)]; j < (I + 1) * kRows; ++j)
    std::fill(panel[j].row + n % kRows, panel[j].row + kRows, 0.0);
}

// A panel begins where the first of its rows does.
void LandmarkFactor::update_panel_begins(int first_panel) noexcept {
  for (int I = first_panel; I < panels(n_); ++I) {
    const auto rows = first_neighbours_.begin() + I * kRows;
    const int begin = *std::min_element(rows, rows + kRows);
    panel_begins_[at(I)] = begin / kStep * kStep;
  }
}

double LandmarkFactor::assemble(int first_row) noexcept {
  const int first_panel = first_row / kRows;
  update_panel_begins(first_panel);
  double least = support_radius_ * support_radius_;
  for (int I = first_panel; I < panels(n_); ++I)
    least = std::min(least, assembly_.assemble(matrix(), places(), support_radius_, I, n_));
  return least;
}

bool LandmarkFactor::factor(int first_row) noexcept {
  return loops_.factor(matrix(), first_row / kRows, panels(n_), n_);
}

// The bordered matrix [K k; kᵀ 1] has the factor [L 0; vᵀ √(1 − |v|²)] with v = L⁻¹ k (Golub & Van Loan, Matrix
// Computations, 4th ed., section 4.2).
bool LandmarkFactor::append(const Vec3& p, int first_neighbour) noexcept {
  const int row = n_, I = row / kRows, begin = first_neighbour / kStep * kStep;
  const PanelMatrix m = matrix();
  double* v = vectors().plane[0];
  std::fill(v + begin / kRows * kRows, v + begin, 0.0);
  assembly_.assemble_row(places(), p.x(), p.y(), p.z(), support_radius_, begin, row, v);
  std::fill(v + row, v + (I + 1) * kRows, 0.0);
  const double pivot = loops_.factor_row(m, row, begin, v);
  if (!(pivot > 0)) return false;

  const bool is_new_panel = row % kRows == 0;
  const int old_begin = is_new_panel ? (I + 1) * kRows : panel_begins_[at(I)];
  if (begin < old_begin) {
    std::fill(m.panel(I) + begin, m.panel(I) + old_begin, PanelColumn{});
    panel_begins_[at(I)] = begin;
  }
  for (int j = begin; j < row; ++j) m.panel(I)[j].row[row % kRows] = v[j];
  const double inverse = 1 / std::sqrt(pivot);
  m.panel(I)[row] = PanelColumn{};
  m.panel(I)[row].row[row % kRows] = pivot * inverse;
  inverse_diagonal_[at(row)] = inverse;
  push_back(p, first_neighbour);
  return true;
}

// Column `column` of L into values[row], rows from from_row to n; zero left of the envelope.
void LandmarkFactor::load_column(int column, int from_row, std::span<const int> begins,
                                 double* values) noexcept {
  const PanelMatrix m = matrix();
  for (int I = from_row / kRows; I < panels(n_); ++I) {
    double* to = values + I * kRows;
    if (column >= begins[at(I)])
      std::copy_n(m.panel(I)[column].row, kRows, to);
    else
      std::fill_n(to, kRows, 0.0);
  }
}

// values[row] into column `column` of L, rows from from_row to end_row.
void LandmarkFactor::store_column(int column, int from_row, int end_row, const double* values) noexcept {
  const PanelMatrix m = matrix();
  for (int row = from_row; row < end_row;) {
    const int I = row / kRows, end = std::min((I + 1) * kRows, end_row);
    if (column >= panel_begins_[at(I)])
      std::copy(values + row, values + end, m.panel(I)[column].row + row % kRows);
    row = end;
  }
}

// Without row k, the rows after it satisfy L₃₃′ L₃₃′ᵀ = L₃₃ L₃₃ᵀ + l l ᵀ with l = column k below the diagonal: a
// rank-one update, by one rotation a column (Golub & Van Loan, Matrix Computations, 4th ed., section 6.5). Rows and
// columns after k move up by one on the way. l has no entries outside the rows that began at or before k, so nothing
// fills outside the envelope.
void LandmarkFactor::remove(int k) noexcept {
  assert(k >= 0 && k < n_);
  std::copy(panel_begins_.begin(), panel_begins_.end(), old_begins_.begin());
  const int last = n_ - 1;
  for (int row = k; row < last; ++row) {
    place(row, {x_[at(row + 1)], y_[at(row + 1)], z_[at(row + 1)]});
    const int first = first_neighbours_[at(row + 1)];
    first_neighbours_[at(row)] = first > k ? first - 1 : first;
  }
  place_out_of_reach(last);
  update_panel_begins(k / kRows);

  for (int j = 0; j < k; ++j) {
    load_column(j, k, old_begins_, column_.data());
    std::copy(column_.begin() + k + 1, column_.begin() + n_, column_.begin() + k);
    column_[at(last)] = 0;
    store_column(j, k / kRows * kRows, n_, column_.data());
  }
  load_column(k, k, old_begins_, carry_.data());
  for (int j = k + 1; j < n_; ++j) {
    load_column(j, j, old_begins_, column_.data());
    const double diagonal = column_[at(j)], l = carry_[at(j)], r = std::sqrt(diagonal * diagonal + l * l);
    loops_.rotate(column_.data() + j, carry_.data() + j, diagonal / r, l / r, at(n_ - j));
    std::copy(column_.begin() + j, column_.begin() + n_, column_.begin() + j - 1);
    column_[at(last)] = 0;
    store_column(j - 1, j - 1, n_, column_.data());
    inverse_diagonal_[at(j - 1)] = 1 / r;
  }
  n_ = last;
}

void LandmarkFactor::solve_lower(int first) noexcept {
  const PanelVectors v = vectors();
  for (double* plane : v.plane) std::fill(plane + n_, plane + panels(n_) * kRows, 0.0);
  loops_.forward(matrix(), n_, first, v);
}

void LandmarkFactor::solve(int first) noexcept {
  solve_lower(first);
  loops_.backward(matrix(), n_, vectors());
}

// ‖K‖₁ = max_i (L Lᵀ 1)_i, as no ψ is negative.
double LandmarkFactor::norm() noexcept {
  const PanelMatrix m = matrix();
  double* sums = vectors().plane[0];  // Lᵀ 1
  std::fill_n(sums, n_, 0.0);
  const auto columns = [&](int I, auto&& visit) {
    const int end = std::min((I + 1) * kRows, n_);
    for (int j = panel_begins_[at(I)]; j < end; ++j) visit(m.panel(I)[j].row, sums[j]);
  };
  for (int I = 0; I < panels(n_); ++I)
    columns(I, [](const double* row, double& sum) {
      double s[kRows / 2];  // partial sums: one chain of additions would wait for each
      for (int i = 0; i < 8; ++i) s[i] = row[i] + row[i + 8];
      for (int i = 0; i < 4; ++i) s[i] += s[i + 4];
      sum += s[0] + s[1] + (s[2] + s[3]);
    });
  double largest = 0;
  for (int I = 0; I < panels(n_); ++I) {
    double rows[kRows] = {};
    columns(I, [&](const double* row, double sum) {
      for (int i = 0; i < kRows; ++i) rows[i] += row[i] * sum;
    });
    largest = std::max(largest, *std::max_element(rows, rows + kRows));
  }
  return largest;
}

double LandmarkFactor::condition() noexcept {
  if (n_ == 0) return 1;
  const double matrix_norm = norm();
  const PanelVectors x = vectors();
  return matrix_norm *
         estimate_inverse_norm(
             at(n_), x.plane, [&](std::size_t row) { return inverse_diagonal_[row]; }, [&] { solve(); });
}

}  // namespace brachy
