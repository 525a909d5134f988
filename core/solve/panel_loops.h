#pragma once

#include <cstddef>

#include "core/base/simd/simd_target.h"

namespace brachy {

/// One column of a panel: 16 consecutive rows of the factor.
struct alignas(64) PanelColumn {
  static constexpr int kRows = 16;
  double row[kRows];
};

/// The lower triangle of an n × n matrix as panels of 16 rows, column after column, each panel as wide as its last row:
/// panel I begins at column panel_begin(I) of `columns`. Columns of panel I left of first_column[I] are zero and
/// never read (an envelope; 0 everywhere is a dense matrix). Rows from n on are zero.
struct PanelMatrix {
  static constexpr int kRows = PanelColumn::kRows;
  static constexpr int kColumnStep = 8;  ///< first_column is a multiple of this

  PanelColumn* columns;
  const int* first_column;   ///< one a panel, ≤ 16 I
  double* inverse_diagonal;  ///< 1/L_jj, n

  static constexpr std::size_t panel_begin(int panel) {
    return static_cast<std::size_t>(kRows) / 2 * static_cast<std::size_t>(panel) *
           (static_cast<std::size_t>(panel) + 1);
  }
  PanelColumn* panel(int I) const { return columns + panel_begin(I); }
};

/// The same of a band: every panel keeps `band` columns left of the 16 on its diagonal, no more. A type of its own,
/// since a choice in PanelMatrix::panel costs the dense factor its bits (the compiler fuses other products).
struct BandMatrix : PanelMatrix {
  int band;  ///< a multiple of kColumnStep

  /// Where column 0 of the panel would be.
  PanelColumn* panel(int I) const {
    return columns + (static_cast<std::size_t>(I) + 1) * static_cast<std::size_t>(band);
  }
};

/// Three right-hand sides as planes of n rounded up to whole panels.
struct PanelVectors {
  static constexpr int kCount = 3;
  double* plane[kCount];
};

/// The inner loops of Cholesky's method for one instruction set. Every element of L is one chain of multiply-adds
/// over ascending columns, however the loops are blocked, so that rows computed later have the same bits as rows
/// computed at once.
/// Threads: any. Real-time: no allocation.
struct PanelLoops {
  /// Replaces K in panels [begin, end) by L, for n rows in all; the panels before are factored. False where a pivot is
  /// not positive.
  bool (*factor)(const PanelMatrix& matrix, int begin, int end, int n);
  bool (*factor_band)(const BandMatrix& matrix, int begin, int end, int n);
  /// Row n of L, from row n of K in v (n entries from column `first` on, zero before): v = L⁻¹ v. Returns the pivot
  /// 1 − |v|². Up to 7 entries beyond v's last panel are read but not used.
  double (*factor_row)(const PanelMatrix& matrix, int n, int first, double* v);
  /// v = L⁻¹ v, given that v is zero before row `first`.
  void (*forward)(const PanelMatrix& matrix, int n, int first, const PanelVectors& v);
  /// v = L⁻ᵀ v.
  void (*backward)(const PanelMatrix& matrix, int n, const PanelVectors& v);
  /// (x, y) = (c x + s y, c y − s x), element by element: a Givens rotation of two columns.
  void (*rotate)(double* x, double* y, double c, double s, std::size_t count);
};

/// The loops for `target`, which this processor must support.
const PanelLoops& panel_loops(SimdTarget target);

}  // namespace brachy
