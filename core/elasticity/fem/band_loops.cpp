// Compiled with -ffp-contract=fast: where a target has FMA, c − a·b is one instruction.
#include "core/elasticity/fem/band_loops.h"

#include <algorithm>

#include "core/base/simd/simd_attributes.h"
#include "core/base/simd/vector_memory.h"

namespace brachy {
namespace {

constexpr int kRows = PanelMatrix::kRows, kStep = PanelMatrix::kColumnStep;

/// A vector register of kBytes; kVectorCount × kUnrollCount of them are summed up at once.
template <int kBytes, int kVectorCount, int kUnrollCount>
struct Width {
  typedef double Vector __attribute__((vector_size(kBytes)));
  static constexpr int kLanes = kBytes / static_cast<int>(sizeof(double));
  static constexpr int kVectors = kVectorCount, kUnrolled = kUnrollCount;
  static constexpr int kColumns = kLanes * kVectors;
  static_assert(BandRow::kCount % kColumns == 0 && kStep % kUnrolled == 0);
};

// A panel is read from memory once for all sets, and while they use it the next one is on its way: without that a third
// of the time is spent waiting for it.
BRACHY_INLINE void prefetch(const double* at) {
  __builtin_prefetch(at, 0, 2);
}

// y[q] −= Σ_k factor(k, q) x[k] for kUnrolled rows y and `count` rows x, columns from `column` on; ahead(k) fetches
// what is needed later.
template <class W, class Factor, class Ahead>
BRACHY_INLINE void subtract(BandRow* y, const BandRow* x, int count, int column, const Factor& factor,
                            const Ahead& ahead) {
  using V = typename W::Vector;
  V sum[W::kUnrolled][W::kVectors];
#pragma GCC unroll 8
  for (int q = 0; q < W::kUnrolled; ++q)
#pragma GCC unroll 8
    for (int v = 0; v < W::kVectors; ++v) sum[q][v] = load<V>(y[q].column + column + v * W::kLanes);
  for (int k = 0; k < count; ++k) {
    ahead(k);
    V xk[W::kVectors];
#pragma GCC unroll 8
    for (int v = 0; v < W::kVectors; ++v) xk[v] = load<V>(x[k].column + column + v * W::kLanes);
#pragma GCC unroll 8
    for (int q = 0; q < W::kUnrolled; ++q) {
      const double l = factor(k, q);
#pragma GCC unroll 8
      for (int v = 0; v < W::kVectors; ++v) sum[q][v] -= xk[v] * l;
    }
  }
#pragma GCC unroll 8
  for (int q = 0; q < W::kUnrolled; ++q)
#pragma GCC unroll 8
    for (int v = 0; v < W::kVectors; ++v) store<V>(y[q].column + column + v * W::kLanes, sum[q][v]);
}

BRACHY_INLINE void scale(BandRow& y, double by) {
  for (int c = 0; c < BandRow::kCount; ++c) y.column[c] *= by;
}

BRACHY_INLINE void subtract_one(BandRow& y, const BandRow& x, double l) {
  for (int c = 0; c < BandRow::kCount; ++c) y.column[c] -= x.column[c] * l;
}

template <class W>
BRACHY_INLINE void forward(const BandMatrix& matrix, int n, int first, const BandSets& sets) {
  for (int I = first / kRows; I * kRows < n; ++I) {
    const int diagonal = I * kRows, last = std::min(n, diagonal + kRows);
    const int begin = std::min(diagonal, std::max(matrix.first_column[I], first / kRows * kRows));
    const PanelColumn *L = matrix.panel(I), *next = matrix.panel(last < n ? I + 1 : I);
    for (std::size_t set = 0; set < sets.count; ++set) {
      BandRow* x = sets.x + set * sets.stride;
      for (int column = 0; column < BandRow::kCount; column += W::kColumns)
        for (int row = 0; row < kRows; row += W::kUnrolled)
          subtract<W>(
              x + diagonal + row, x + begin, diagonal - begin, column,
              [=](int k, int q) { return L[begin + k].row[row + q]; },
              [=](int k) { prefetch(&next[begin + k + kRows].row[row]); });
      for (int j = diagonal; j < last; ++j) {
        scale(x[j], matrix.inverse_diagonal[j]);
        for (int i = j + 1; i < last; ++i) subtract_one(x[i], x[j], L[j].row[i - diagonal]);
      }
    }
  }
}

template <class W>
BRACHY_INLINE void backward(const BandMatrix& matrix, int n, int first, const BandSets& sets) {
  const int panels = (n + kRows - 1) / kRows;
  for (int I = panels - 1; I >= first / kRows; --I) {
    const int diagonal = I * kRows, last = std::min(n, diagonal + kRows);
    const int begin = std::max(matrix.first_column[I], first / kRows * kRows);
    const PanelColumn *L = matrix.panel(I), *next = matrix.panel(std::max(0, I - 1));
    for (std::size_t set = 0; set < sets.count; ++set) {
      BandRow* x = sets.x + set * sets.stride;
      for (int j = last - 1; j >= diagonal; --j) {
        scale(x[j], matrix.inverse_diagonal[j]);
        for (int i = diagonal; i < j; ++i) subtract_one(x[i], x[j], L[i].row[j - diagonal]);
      }
      for (int column = 0; column < BandRow::kCount; column += W::kColumns)
        for (int k = begin; k < diagonal; k += W::kUnrolled)
          subtract<W>(
              x + k, x + diagonal, last - diagonal, column, [=](int row, int q) { return L[k + q].row[row]; },
              [=](int row) { prefetch(&next[k + row / 2 - kRows].row[row % 2 * kRows / 2]); });
    }
  }
}

// One copy of the loops for a target.
// NOLINTBEGIN(bugprone-macro-parentheses): an attribute or a template cannot stand in parentheses.
#define BRACHY_TARGET(name, attribute, bytes, vectors, unrolled)                                     \
  struct name {                                                                                      \
    using W = Width<bytes, vectors, unrolled>;                                                       \
    attribute static void solve_lower(const BandMatrix& m, int n, int first, const BandSets& sets) { \
      forward<W>(m, n, first, sets);                                                                 \
    }                                                                                                \
    attribute static void solve_upper(const BandMatrix& m, int n, int first, const BandSets& sets) { \
      backward<W>(m, n, first, sets);                                                                \
    }                                                                                                \
    static constexpr BandLoops kLoops{solve_lower, solve_upper};                                     \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(Generic, , 16, 3, 4);
BRACHY_TARGET(Sse4, BRACHY_SSE4, 16, 3, 4);
BRACHY_TARGET(Avx2, BRACHY_AVX2, 32, 3, 4);
BRACHY_TARGET(Avx512, BRACHY_AVX512, 64, 3, 8);

}  // namespace

const BandLoops& band_loops(SimdTarget target) {
  return loops_for(target, Generic::kLoops, Sse4::kLoops, Avx2::kLoops, Avx512::kLoops);
}

}  // namespace brachy
