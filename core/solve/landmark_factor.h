#pragma once

#include <span>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/solve/assembly_loops.h"

namespace brachy {

/// The Cholesky factor L of K_ij = ψ(|p_i − p_j| / a), row by row in the order given, stored as an envelope: row i
/// begins at its first neighbour, the earliest row whose landmark is nearer than a. Dense is the envelope in which
/// every row begins at 0.
///
/// A row of L depends on the rows before it only, so that a landmark is added by one triangular solve, O(n²), with the
/// same bits as in a factorisation from scratch.
/// Threads: one. Real-time: no allocation after construction, at any n ≤ capacity; no exceptions.
class LandmarkFactor {
 public:
  LandmarkFactor(const Kernel& kernel, SimdTarget target, double support_radius, int capacity);

  int size() const { return n_; }  ///< rows, pushed ones included
  /// For push_back and append: a row at or shortly before the first whose landmark is nearer than a to p.
  int first_neighbour(const Vec3& p) const noexcept {
    return assembly_.first_within(places(), p.x(), p.y(), p.z(), support_radius_, 0, n_);
  }

  /// Adds a row (mm) that factor must be called for. `first_neighbour`: no landmark in a row before it is nearer
  /// than a.
  void push_back(const Vec3& p, int first_neighbour) noexcept;
  /// Drops the rows from n on.
  void truncate(int n) noexcept;

  /// K of the rows from `first_row` on (and those before in its panel); returns the least |p_i − p_j|² among them and
  /// against earlier rows, or a² if none is nearer.
  double assemble(int first_row) noexcept;
  /// Factors what assemble(first_row) filled. False: not positive definite; call truncate(0) before anything else.
  bool factor(int first_row) noexcept;
  /// Adds a row to the factor (a bordered update); false leaves it as it was.
  bool append(const Vec3& p, int first_neighbour) noexcept;
  /// Deletes row and column `row` of K from the factor: O((n − row)²) by Givens rotations, which cannot break down.
  void remove(int row) noexcept;

  /// Right-hand sides for solve: three planes of capacity, of which size() count. Solve overwrites them.
  PanelVectors vectors() noexcept {
    const std::size_t rows = planes_.size() / 3;
    return {{planes_.data(), planes_.data() + rows, planes_.data() + 2 * rows}};
  }
  /// vectors = K⁻¹ vectors, which are zero before row `first`.
  void solve(int first = 0) noexcept;
  /// vectors = L⁻¹ vectors, which are zero before row `first`.
  void solve_lower(int first) noexcept;

  /// ‖K‖₁ times an estimate of ‖K⁻¹‖₁ (norm_estimate.h): at most 3 solves, and overwrites the vectors. 1 without rows.
  double condition() noexcept;

 private:
  static std::size_t at(int row) { return static_cast<std::size_t>(row); }
  static int panels(int n) { return (n + PanelMatrix::kRows - 1) / PanelMatrix::kRows; }
  PanelPositions places() const { return {x_.data(), y_.data(), z_.data()}; }
  PanelMatrix matrix() noexcept { return {columns_.data(), panel_begins_.data(), inverse_diagonal_.data()}; }
  void place(int row, const Vec3& p) noexcept;
  void place_out_of_reach(int row) noexcept;
  void update_panel_begins(int first_panel) noexcept;
  double norm() noexcept;
  void load_column(int column, int from_row, std::span<const int> begins, double* values) noexcept;
  void store_column(int column, int from_row, int end_row, const double* values) noexcept;

  const AssemblyLoops& assembly_;
  const PanelLoops& loops_;
  double support_radius_;
  int n_ = 0;
  std::vector<PanelColumn> columns_;   // PanelMatrix
  std::vector<int> first_neighbours_;  // of each row
  std::vector<int> panel_begins_, old_begins_;
  std::vector<double> inverse_diagonal_;
  std::vector<double> x_, y_, z_;
  std::vector<double> planes_;          // 3 × padded capacity
  std::vector<double> carry_, column_;  // of remove
};

}  // namespace brachy
