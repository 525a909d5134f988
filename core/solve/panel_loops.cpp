// Compiled with -ffp-contract=fast: where a target has FMA, c − a·b is one instruction.
#include "core/solve/panel_loops.h"

#include <algorithm>
#include <cmath>

#include "core/base/simd/simd_attributes.h"
#include "core/base/simd/vector_memory.h"

namespace brachy {
namespace {

constexpr int kRows = PanelMatrix::kRows;
constexpr int kGroup = 4;  // panels that are factored together, so that the rows they need are read only once
constexpr int kCount = PanelVectors::kCount;

/// A vector register of kBytes, and how many columns of L are computed in registers at once.
template <int kBytes, int kColumnCount>
struct Width {
  typedef double Vector __attribute__((vector_size(kBytes)));
  static constexpr int kLanes = kBytes / static_cast<int>(sizeof(double));
  static constexpr int kColumns = kColumnCount;
};

// Rows [row, row + 2 vectors) of panel I, columns [j, j + kColumns) of L, which belong to the rows of panel J: subtract
// Σ_k L_ik L_jk over the columns before j; with kSolve also divide by the triangle on J's diagonal.
template <class W, bool kSolve, class Matrix>
BRACHY_INLINE void update_block(const Matrix& matrix, int I, int J, int row, int j) {
  using V = typename W::Vector;
  const int k0 = std::max(matrix.first_column[I], matrix.first_column[J]), row_j = j - J * kRows;
  double* c = matrix.panel(I)[j].row + row;
  V sum[W::kColumns][2];
#pragma GCC unroll 8
  for (int q = 0; q < W::kColumns; ++q) {
    sum[q][0] = load<V>(c + q * kRows);
    sum[q][1] = load<V>(c + q * kRows + W::kLanes);
  }
  const double* a = matrix.panel(I)[k0].row + row;
  const double* b = matrix.panel(J)[k0].row + row_j;
  for (int k = k0; k < j; ++k, a += kRows, b += kRows) {
    const V a0 = load<V>(a), a1 = load<V>(a + W::kLanes);
#pragma GCC unroll 8
    for (int q = 0; q < W::kColumns; ++q) {
      sum[q][0] -= a0 * b[q];
      sum[q][1] -= a1 * b[q];
    }
  }
  if constexpr (kSolve) {
    const double* triangle = matrix.panel(J)[j].row + row_j;
#pragma GCC unroll 8
    for (int q = 0; q < W::kColumns; ++q) {
      sum[q][0] *= matrix.inverse_diagonal[j + q];
      sum[q][1] *= matrix.inverse_diagonal[j + q];
#pragma GCC unroll 8
      for (int p = q + 1; p < W::kColumns; ++p) {
        sum[p][0] -= sum[q][0] * triangle[q * kRows + p];
        sum[p][1] -= sum[q][1] * triangle[q * kRows + p];
      }
    }
  }
#pragma GCC unroll 8
  for (int q = 0; q < W::kColumns; ++q) {
    store<V>(c + q * kRows, sum[q][0]);
    store<V>(c + q * kRows + W::kLanes, sum[q][1]);
  }
}

// The square block of panel I under the rows of panel J < I.
template <class W, class Matrix>
BRACHY_INLINE void factor_below(const Matrix& matrix, int I, int J) {
  for (int j = std::max(J * kRows, matrix.first_column[I]); j < (J + 1) * kRows; j += W::kColumns)
    for (int row = 0; row < kRows; row += 2 * W::kLanes) update_block<W, true>(matrix, I, J, row, j);
}

// Cholesky of `count` ≤ kColumns columns from j on panel I's diagonal, already updated by the columns before.
template <class W, class Matrix>
BRACHY_INLINE bool factor_columns(const Matrix& matrix, int I, int j, int count) {
  PanelColumn* column = matrix.panel(I) + j;
  const int row_j = j - I * kRows;
  for (int q = 0; q < count; ++q) {
    const int pivot_row = row_j + q;
    const double pivot = column[q].row[pivot_row];
    if (!(pivot > 0)) return false;
    const double inverse = 1 / std::sqrt(pivot);
    matrix.inverse_diagonal[j + q] = inverse;
    for (int i = 0; i < kRows; ++i) column[q].row[i] = i < pivot_row ? 0.0 : column[q].row[i] * inverse;
    for (int p = q + 1; p < count; ++p) {
      const double l = column[q].row[row_j + p];
      for (int i = 0; i < kRows; ++i) column[p].row[i] -= column[q].row[i] * l;
    }
  }
  return true;
}

template <class W, class Matrix>
BRACHY_INLINE bool factor(const Matrix& matrix, int begin, int end, int n) {
  for (int group = begin; group < end; group += kGroup) {
    const int group_end = std::min(group + kGroup, end);
    int first = group;
    for (int I = group; I < group_end; ++I) first = std::min(first, matrix.first_column[I] / kRows);
    for (int J = first; J < group; ++J)
      for (int I = group; I < group_end; ++I) factor_below<W>(matrix, I, J);
    for (int I = group; I < group_end; ++I) {
      for (int J = group; J < I; ++J) factor_below<W>(matrix, I, J);
      const int last = std::min(n, (I + 1) * kRows);
      for (int j = I * kRows; j < last; j += W::kColumns) {
        const int above = (j - I * kRows) / (2 * W::kLanes) * (2 * W::kLanes);
        for (int row = above; row < kRows; row += 2 * W::kLanes) update_block<W, false>(matrix, I, I, row, j);
        if (!factor_columns<W>(matrix, I, j, std::min(W::kColumns, last - j))) return false;
      }
    }
  }
  return true;
}

template <class W, int kPlanes>
BRACHY_INLINE void forward(const PanelMatrix& matrix, int n, int first, const PanelVectors& v) {
  using V = typename W::Vector;
  constexpr int kVectors = kRows / W::kLanes;
  for (int I = first / kRows; I * kRows < n; ++I) {
    const PanelColumn* L = matrix.panel(I);
    const int diagonal = I * kRows, last = std::min(n, diagonal + kRows);
    const int k0 = std::max(matrix.first_column[I], first / kRows * kRows);
    for (int half = 0; half < kVectors; half += 2) {  // two registers of rows at a time
      V sum[kPlanes][2];
      for (int c = 0; c < kPlanes; ++c)
        for (int h = 0; h < 2; ++h) sum[c][h] = load<V>(v.plane[c] + diagonal + (half + h) * W::kLanes);
      for (int k = k0; k < diagonal; ++k) {
        const V l0 = load<V>(L[k].row + half * W::kLanes), l1 = load<V>(L[k].row + (half + 1) * W::kLanes);
        for (int c = 0; c < kPlanes; ++c) {
          sum[c][0] -= l0 * v.plane[c][k];
          sum[c][1] -= l1 * v.plane[c][k];
        }
      }
      for (int c = 0; c < kPlanes; ++c)
        for (int h = 0; h < 2; ++h) store<V>(v.plane[c] + diagonal + (half + h) * W::kLanes, sum[c][h]);
    }
    for (int c = 0; c < kPlanes; ++c) {
      double* y = v.plane[c] + diagonal;
      for (int j = diagonal; j < last; ++j) {
        const double solved = y[j - diagonal] * matrix.inverse_diagonal[j];
        for (int i = 0; i < kRows; ++i) y[i] -= L[j].row[i] * solved;  // rows above j are zero
        y[j - diagonal] = solved;
      }
    }
  }
}

template <class W>
BRACHY_INLINE double factor_row(const PanelMatrix& matrix, int n, int first, double* v) {
  forward<W, 1>(matrix, n, first, {{v}});
  // As update_block does it, bit for bit: in registers of which lane 0 counts, or the compiler would multiply ahead and
  // not fuse. The loads end within v's last panel or the plane after it.
  using V = typename W::Vector;
  V pivot = V{} + 1.0;
  for (int j = first; j < n; ++j) {
    const V l = load<V>(v + j);
    pivot -= l * l;
  }
  return pivot[0];
}

template <class W>
BRACHY_INLINE void backward(const PanelMatrix& matrix, int n, const PanelVectors& v) {
  using V = typename W::Vector;
  constexpr int kVectors = kRows / W::kLanes, kColumns = 4;
  const int panels = (n + kRows - 1) / kRows;
  for (int J = panels - 1; J >= 0; --J) {
    const int diagonal = J * kRows, last = std::min(n, diagonal + kRows);
    for (int j = diagonal; j < last; j += kColumns) {
      V sum[kColumns][kCount] = {};
      for (int I = J + 1; I < panels; ++I) {
        if (matrix.first_column[I] > j) continue;
        const PanelColumn* L = matrix.panel(I) + j;
        for (int h = 0; h < kVectors; ++h) {
          V x[kCount];
          for (int c = 0; c < kCount; ++c) x[c] = load<V>(v.plane[c] + I * kRows + h * W::kLanes);
          for (int q = 0; q < kColumns; ++q) {
            const V l = load<V>(L[q].row + h * W::kLanes);
            for (int c = 0; c < kCount; ++c) sum[q][c] += l * x[c];
          }
        }
      }
      for (int q = 0; q < kColumns; ++q)
        for (int c = 0; c < kCount; ++c) {
          double total = 0;
          for (int lane = 0; lane < W::kLanes; ++lane) total += sum[q][c][lane];
          v.plane[c][j + q] -= total;
        }
    }
    const PanelColumn* L = matrix.panel(J);
    for (int c = 0; c < kCount; ++c) {
      double* x = v.plane[c];
      for (int j = last - 1; j >= diagonal; --j) {
        x[j] *= matrix.inverse_diagonal[j];
        for (int k = diagonal; k < j; ++k) x[k] -= L[k].row[j - diagonal] * x[j];
      }
    }
  }
}

BRACHY_INLINE void rotate(double* __restrict x, double* __restrict y, double c, double s, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const double rotated = c * x[i] + s * y[i];
    y[i] = c * y[i] - s * x[i];
    x[i] = rotated;
  }
}

// One copy of the loops for a target.
// NOLINTBEGIN(bugprone-macro-parentheses): an attribute or a template cannot stand in parentheses.
#define BRACHY_TARGET(name, attribute, bytes, columns)                                                 \
  struct name {                                                                                        \
    using W = Width<bytes, columns>;                                                                   \
    attribute static bool factor_panels(const PanelMatrix& m, int begin, int end, int n) {             \
      return factor<W>(m, begin, end, n);                                                              \
    }                                                                                                  \
    attribute static bool factor_band_panels(const BandMatrix& m, int begin, int end, int n) {         \
      return factor<W>(m, begin, end, n);                                                              \
    }                                                                                                  \
    attribute static double border(const PanelMatrix& m, int n, int first, double* v) {                \
      return factor_row<W>(m, n, first, v);                                                            \
    }                                                                                                  \
    attribute static void solve_lower(const PanelMatrix& m, int n, int first, const PanelVectors& v) { \
      forward<W, kCount>(m, n, first, v);                                                              \
    }                                                                                                  \
    attribute static void solve_upper(const PanelMatrix& m, int n, const PanelVectors& v) {            \
      backward<W>(m, n, v);                                                                            \
    }                                                                                                  \
    attribute static void turn(double* x, double* y, double c, double s, std::size_t count) {          \
      rotate(x, y, c, s, count);                                                                       \
    }                                                                                                  \
    static constexpr PanelLoops kLoops{factor_panels, factor_band_panels, border,                      \
                                       solve_lower,   solve_upper,        turn};                       \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(Generic, , 16, 4);
BRACHY_TARGET(Sse4, BRACHY_SSE4, 16, 4);
BRACHY_TARGET(Avx2, BRACHY_AVX2, 32, 4);
BRACHY_TARGET(Avx512, BRACHY_AVX512, 64, 8);

}  // namespace

const PanelLoops& panel_loops(SimdTarget target) {
  return loops_for(target, Generic::kLoops, Sse4::kLoops, Avx2::kLoops, Avx512::kLoops);
}

}  // namespace brachy
