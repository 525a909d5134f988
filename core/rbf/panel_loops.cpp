// Compiled with -ffp-contract=fast: where a target has FMA, c − a·b is one instruction.
#include "core/rbf/panel_loops.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

// Each function with one of these attributes is a copy of the loops below for its target (as in block_kernels.cpp).
#if defined(__x86_64__)
#define BRACHY_SSE4 __attribute__((target("sse4.2"), flatten))
#define BRACHY_AVX2 __attribute__((target("avx2,fma"), flatten))
#if defined(__clang__)
#define BRACHY_AVX512 __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,fma"), flatten))
#else
#define BRACHY_AVX512 \
  __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,fma,prefer-vector-width=512"), flatten))
#endif
#else
#define BRACHY_SSE4
#define BRACHY_AVX2
#define BRACHY_AVX512
#endif
#define BRACHY_INLINE inline __attribute__((always_inline))

namespace brachy {
namespace {

constexpr int kRows = PanelMatrix::kRows;
constexpr int kGroup =
    4;  // panels that are factored together, so that the rows they need are read once for all
constexpr int kCount = PanelVectors::kCount;

/// A vector register of kBytes, and how many columns of L are computed in registers at once.
template <int kBytes, int kColumns_>
struct Width {
  typedef double Vector __attribute__((vector_size(kBytes)));
  static constexpr int kLanes = kBytes / static_cast<int>(sizeof(double));
  static constexpr int kColumns = kColumns_;
};

template <class V>
BRACHY_INLINE V load(const double* p) {
  V v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

template <class V>
BRACHY_INLINE void store(double* p, V v) {
  std::memcpy(p, &v, sizeof v);
}

// Rows [row, row + 2 vectors) of panel I, columns [j, j + kColumns) of L, which belong to the rows of panel J: subtract
// Σ_k L_ik L_jk over the columns before j; with kSolve also divide by the triangle on J's diagonal.
template <class W, bool kSolve>
BRACHY_INLINE void update_block(const PanelMatrix& matrix, int I, int J, int row, int j) {
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
template <class W>
BRACHY_INLINE void factor_below(const PanelMatrix& matrix, int I, int J) {
  for (int j = std::max(J * kRows, matrix.first_column[I]); j < (J + 1) * kRows; j += W::kColumns)
    for (int row = 0; row < kRows; row += 2 * W::kLanes) update_block<W, true>(matrix, I, J, row, j);
}

// Cholesky of `count` ≤ kColumns columns from j on panel I's diagonal, already updated by the columns before.
template <class W>
BRACHY_INLINE bool factor_columns(const PanelMatrix& matrix, int I, int j, int count) {
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

template <class W>
BRACHY_INLINE bool factor(const PanelMatrix& matrix, int begin, int end, int n) {
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

template <class W>
BRACHY_INLINE void forward(const PanelMatrix& matrix, int n, int first, const PanelVectors& v) {
  using V = typename W::Vector;
  constexpr int kVectors = kRows / W::kLanes;
  for (int I = first / kRows; I * kRows < n; ++I) {
    const PanelColumn* L = matrix.panel(I);
    const int diagonal = I * kRows, last = std::min(n, diagonal + kRows);
    const int k0 = std::max(matrix.first_column[I], first / kRows * kRows);
    for (int half = 0; half < kVectors; half += 2) {  // two registers of rows at a time
      V sum[kCount][2];
      for (int c = 0; c < kCount; ++c)
        for (int h = 0; h < 2; ++h) sum[c][h] = load<V>(v.plane[c] + diagonal + (half + h) * W::kLanes);
      for (int k = k0; k < diagonal; ++k) {
        const V l0 = load<V>(L[k].row + half * W::kLanes), l1 = load<V>(L[k].row + (half + 1) * W::kLanes);
        for (int c = 0; c < kCount; ++c) {
          sum[c][0] -= l0 * v.plane[c][k];
          sum[c][1] -= l1 * v.plane[c][k];
        }
      }
      for (int c = 0; c < kCount; ++c)
        for (int h = 0; h < 2; ++h) store<V>(v.plane[c] + diagonal + (half + h) * W::kLanes, sum[c][h]);
    }
    for (int c = 0; c < kCount; ++c) {
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

BRACHY_INLINE int first_within(const PanelPositions& p, double x, double y, double z, double radius,
                               int begin, int end) {
  constexpr int kStep = PanelMatrix::kColumnStep;
  for (; begin + kStep <= end; begin += kStep) {
    std::int64_t hits = 0;  // as wide as a double: the loop vectorises
    for (int i = 0; i < kStep; ++i) {
      const double dx = p.x[begin + i] - x, dy = p.y[begin + i] - y, dz = p.z[begin + i] - z;
      hits += dx * dx + dy * dy + dz * dz < radius * radius ? 1 : 0;
    }
    if (hits > 0) break;
  }
  return begin;
}

// ψ of eight rows of a panel against one landmark; `self`: which of the eight that landmark is, if any.
constexpr int kHalf = kRows / 2;
template <class K>
BRACHY_INLINE void assemble_rows(const double* px, const double* py, const double* pz, double x, double y,
                                 double z, double inverse_radius, int self, double* __restrict row,
                                 double* __restrict least) {
  for (int i = 0; i < kHalf; ++i) {
    const double dx = px[i] - x, dy = py[i] - y, dz = pz[i] - z;
    const double squared = dx * dx + dy * dy + dz * dz;
    const double other = i == self ? least[i] : squared;
    least[i] = other < least[i] ? other : least[i];
    const double r = std::sqrt(squared) * inverse_radius;
    row[i] = K::inside(r < 1 ? r : 1.0);
  }
}

template <class K>
BRACHY_INLINE double assemble(const PanelMatrix& matrix, const PanelPositions& p, double support_radius,
                              int I, int n) {
  double least[kHalf];
  for (double& l : least) l = support_radius * support_radius;
  for (int first = I * kRows; first < (I + 1) * kRows; first += kHalf) {
    PanelColumn* panel = matrix.panel(I);
    const int row = first - I * kRows,
              last = std::min(n, first + kHalf);  // columns right of these rows' are not read
    if (first >= n) {
      for (int j = matrix.first_column[I]; j < n; ++j) std::fill_n(panel[j].row + row, kHalf, 0.0);
      break;
    }
    for (int j = matrix.first_column[I]; j < last; ++j)
      assemble_rows<K>(p.x + first, p.y + first, p.z + first, p.x[j], p.y[j], p.z[j], 1 / support_radius,
                       j - first, panel[j].row + row, least);
  }
  return *std::min_element(least, least + kHalf);
}

// One copy of the loops for a target.
#define BRACHY_TARGET(name, attribute, bytes, columns)                                                 \
  template <class K>                                                                                   \
  struct name {                                                                                        \
    using W = Width<bytes, columns>;                                                                   \
    attribute static bool factor_panels(const PanelMatrix& m, int begin, int end, int n) {             \
      return factor<W>(m, begin, end, n);                                                              \
    }                                                                                                  \
    attribute static void solve_lower(const PanelMatrix& m, int n, int first, const PanelVectors& v) { \
      forward<W>(m, n, first, v);                                                                      \
    }                                                                                                  \
    attribute static void solve_upper(const PanelMatrix& m, int n, const PanelVectors& v) {            \
      backward<W>(m, n, v);                                                                            \
    }                                                                                                  \
    attribute static void turn(double* x, double* y, double c, double s, std::size_t count) {          \
      rotate(x, y, c, s, count);                                                                       \
    }                                                                                                  \
    attribute static int search(const PanelPositions& p, double x, double y, double z, double radius,  \
                                int begin, int end) {                                                  \
      return first_within(p, x, y, z, radius, begin, end);                                             \
    }                                                                                                  \
    attribute static double fill(const PanelMatrix& m, const PanelPositions& p, double radius, int I,  \
                                 int n) {                                                              \
      return assemble<K>(m, p, radius, I, n);                                                          \
    }                                                                                                  \
    static constexpr PanelLoops kLoops{factor_panels, solve_lower, solve_upper, turn, search, fill};   \
  }

BRACHY_TARGET(Generic, , 16, 4);
BRACHY_TARGET(Sse4, BRACHY_SSE4, 16, 4);
BRACHY_TARGET(Avx2, BRACHY_AVX2, 32, 4);
BRACHY_TARGET(Avx512, BRACHY_AVX512, 64, 8);

}  // namespace

const PanelLoops& panel_loops(const Kernel& kernel, SimdTarget target) {
  return std::visit(
      [&]<class K>(K) -> const PanelLoops& {
        switch (target) {
          case SimdTarget::kSse4:
            return Sse4<K>::kLoops;
          case SimdTarget::kAvx2:
            return Avx2<K>::kLoops;
          case SimdTarget::kAvx512:
            return Avx512<K>::kLoops;
          case SimdTarget::kGeneric:
            break;
        }
        return Generic<K>::kLoops;
      },
      kernel);
}

}  // namespace brachy
