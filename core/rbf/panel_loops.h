#pragma once

#include <cstddef>

#include "core/field/simd_target.h"
#include "core/kernels/kernels.h"

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

/// Places of the landmarks as planes, mm, in the factor's order; the rows that pad the last panel lie so far away that
/// no support reaches anything.
struct PanelPositions {
  const double *x, *y, *z;
};

/// Three right-hand sides as planes of n rounded up to whole panels.
struct PanelVectors {
  static constexpr int kCount = 3;
  double* plane[kCount];
};

/// The inner loops of the landmark system for one instruction set. Every element of L is one chain of multiply-adds
/// over ascending columns, however the loops are blocked, so that rows computed later have the same bits as rows
/// computed at once.
/// Threads: any. Real-time: no allocation.
struct PanelLoops {
  /// Replaces K in panels [begin, end) by L, for n rows in all; the panels before are factored. False where a pivot is
  /// not positive.
  bool (*factor)(const PanelMatrix& matrix, int begin, int end, int n);
  /// v = L⁻¹ v, given that v is zero before row `first`.
  void (*forward)(const PanelMatrix& matrix, int n, int first, const PanelVectors& v);
  /// v = L⁻ᵀ v.
  void (*backward)(const PanelMatrix& matrix, int n, const PanelVectors& v);
  /// (x, y) = (c x + s y, c y − s x), element by element: a Givens rotation of two columns.
  void (*rotate)(double* x, double* y, double c, double s, std::size_t count);
  /// No row of [begin, result) is nearer than `radius` to the place (x, y, z); the result is at most end, and at most
  /// kColumnStep − 1 rows before the first that is nearer.
  int (*first_within)(const PanelPositions& p, double x, double y, double z, double radius, int begin,
                      int end);
  /// K of panel I, columns from first_column[I] to n; returns the least |p_i − p_j|² met with i ≠ j.
  double (*assemble)(const PanelMatrix& matrix, const PanelPositions& p, double support_radius, int I, int n);
};

/// The loops for `kernel` on `target`, which this processor must support.
const PanelLoops& panel_loops(const Kernel& kernel, SimdTarget target);

}  // namespace brachy
