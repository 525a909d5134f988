// Compiled with -ffp-contract=fast: where a target has FMA, c + a·b is one instruction.
#include "core/solve/inverse_loops.h"

#include <algorithm>

#include "core/base/simd/simd_attributes.h"
#include "core/base/simd/vector_memory.h"

namespace brachy {
namespace {

constexpr std::size_t kRows = InverseLoops::kRows;

template <int kBytes>
struct Width {
  typedef double Vector __attribute__((vector_size(kBytes)));
  static constexpr std::size_t kLanes = kBytes / sizeof(double);
  static constexpr std::size_t kTogether = 2 * kLanes;  // columns in registers at once
};

template <class W, std::size_t kCount>
struct Tile {
  typename W::Vector sum[kCount][2] = {};
};

// tile += Σ_k a[k]_q X_k over k0 ≤ k < k1: kCount numbers of column k of A from `a`, two vectors of row k of X from
// `x`.
template <class W, std::size_t kCount>
BRACHY_INLINE void accumulate(const double* a, std::size_t a_step, const double* x, std::size_t x_step,
                              std::size_t k0, std::size_t k1, Tile<W, kCount>& tile) {
  using V = typename W::Vector;
  a += k0 * a_step;
  x += k0 * x_step;
  for (std::size_t k = k0; k < k1; ++k, a += a_step, x += x_step) {
    const V x0 = load<V>(x), x1 = load<V>(x + W::kLanes);
#pragma GCC unroll 4
    for (std::size_t q = 0; q < kCount; ++q) {
      tile.sum[q][0] += a[q] * x0;
      tile.sum[q][1] += a[q] * x1;
    }
  }
}

// Rows [r, r + kCount) of X, two vectors of columns from c on.
template <class W, std::size_t kCount>
BRACHY_INLINE void solve_rows(const double* L, std::size_t outer, std::size_t r, std::size_t start, double* X,
                              std::size_t stride, std::size_t c) {
  using V = typename W::Vector;
  Tile<W, kCount> tile;
  accumulate<W, kCount>(L + r, outer, X + c, stride, std::min(start, r), r, tile);
  for (std::size_t q = 0; q < kCount; ++q) {
    const double* column = L + (r + q) * outer + r;  // from row r on
    const double inverse = 1 / column[q];
    double* x = X + (r + q) * stride + c;
    for (std::size_t h = 0; h < 2; ++h) {
      const V solved = (load<V>(x + h * W::kLanes) - tile.sum[q][h]) * inverse;
      store<V>(x + h * W::kLanes, solved);
      for (std::size_t p = q + 1; p < kCount; ++p) tile.sum[p][h] += column[p] * solved;
    }
  }
}

template <class W>
BRACHY_INLINE void solve_lower(const double* L, std::size_t outer, std::size_t n, const std::uint32_t* starts,
                               double* X, std::size_t stride, std::size_t m) {
  std::size_t r = 0;
  for (; r + kRows <= n; r += kRows)
    for (std::size_t c = 0; c < m && starts[c] < r + kRows; c += W::kTogether)
      solve_rows<W, kRows>(L, outer, r, starts[c], X, stride, c);
  for (; r < n; ++r)
    for (std::size_t c = 0; c < m && starts[c] <= r; c += W::kTogether)
      solve_rows<W, 1>(L, outer, r, starts[c], X, stride, c);
}

// As solve_lower: rows of a panel lie as those of a matrix whose columns are one panel high.
template <class W>
BRACHY_INLINE void solve_panels(const PanelMatrix& L, std::size_t first, std::size_t n,
                                const std::uint32_t* starts, double* X, std::size_t stride, std::size_t m) {
  constexpr std::size_t kHigh = PanelMatrix::kRows;
  const auto panel_of = [&](std::size_t r) {
    const double* first_row = L.panel(static_cast<int>(r / kHigh))->row;
    return first_row - r / kHigh * kHigh;
  };
  std::size_t r = first;
  for (; r + kRows <= n; r += kRows)
    for (std::size_t c = 0; c < m && starts[c] < r + kRows; c += W::kTogether)
      solve_rows<W, kRows>(panel_of(r), kHigh, r, starts[c], X, stride, c);
  for (; r < n; ++r)
    for (std::size_t c = 0; c < m && starts[c] <= r; c += W::kTogether)
      solve_rows<W, 1>(panel_of(r), kHigh, r, starts[c], X, stride, c);
}

template <class W>
BRACHY_INLINE void add_gram(const double* X, std::size_t stride, std::size_t first, std::size_t end,
                            const std::uint32_t* starts, std::size_t m, double* H, std::size_t outer) {
  for (std::size_t j = 0; j < m; j += kRows) {
    const std::size_t columns = std::min(kRows, m - j);
    for (std::size_t c = j / W::kTogether * W::kTogether; c < m; c += W::kTogether) {
      const std::size_t rows = std::min(W::kTogether, m - c);
      const std::size_t start = std::max<std::size_t>({first, starts[j], starts[c]});  // they ascend
      if (start >= end) break;
      Tile<W, kRows> tile;
      double values[kRows][W::kTogether] = {};
      for (std::size_t q = 0; q < columns; ++q) {
        std::copy_n(H + (j + q) * outer + c, rows, values[q]);
        tile.sum[q][0] = load<typename W::Vector>(values[q]);
        tile.sum[q][1] = load<typename W::Vector>(values[q] + W::kLanes);
      }
      accumulate<W, kRows>(X + j, stride, X + c, stride, start, end, tile);
      for (std::size_t q = 0; q < columns; ++q) {
        store(values[q], tile.sum[q][0]);
        store(values[q] + W::kLanes, tile.sum[q][1]);
        const std::size_t from = std::max(c, j + q);
        for (std::size_t i = from; i < c + rows; ++i) H[(j + q) * outer + i] = values[q][i - c];
      }
    }
  }
}

template <class W>
BRACHY_INLINE void product(const double* A, std::size_t a_stride, const std::uint32_t* a_starts,
                           std::size_t columns, const double* X, std::size_t stride,
                           const std::uint32_t* starts, std::size_t m, std::size_t n, double* Z,
                           std::size_t z_stride) {
  for (std::size_t j = 0; j < columns; j += kRows)
    for (std::size_t c = 0; c < m; c += W::kTogether) {
      const std::size_t start = std::min<std::size_t>(std::max(a_starts[j], starts[c]), n);
      Tile<W, kRows> tile;
      accumulate<W, kRows>(A + j, a_stride, X + c, stride, start, n, tile);
      for (std::size_t q = 0; q < std::min(kRows, columns - j); ++q) {
        double* z = Z + (j + q) * z_stride + c;
        store<typename W::Vector>(z, tile.sum[q][0]);
        store<typename W::Vector>(z + W::kLanes, tile.sum[q][1]);
      }
    }
}

template <class W>
BRACHY_INLINE void project(const double* X, std::size_t stride, const std::uint32_t* starts, std::size_t m,
                           const double* y, std::size_t n, double* sums) {
  for (std::size_t c = 0; c < m; c += W::kTogether) {
    Tile<W, 1> tile;
    accumulate<W, 1>(y, 1, X + c, stride, std::min<std::size_t>(starts[c], n), n, tile);
    store<typename W::Vector>(sums + c, tile.sum[0][0]);
    store<typename W::Vector>(sums + c + W::kLanes, tile.sum[0][1]);
  }
}

template <class W>
BRACHY_INLINE void subtract(const double* X, std::size_t stride, const std::uint32_t* starts, std::size_t m,
                            const double* sums, std::size_t n, double* y) {
  using V = typename W::Vector;
  for (std::size_t r = 0; r < n; ++r) {
    V all{};
    for (std::size_t c = 0; c < m && starts[c] <= r; c += W::kTogether) {
      const double* x = X + r * stride + c;
      all += load<V>(x) * load<V>(sums + c) + load<V>(x + W::kLanes) * load<V>(sums + c + W::kLanes);
    }
    double sum = 0;
    for (std::size_t k = 0; k < W::kLanes; ++k) sum += all[k];
    y[r] -= sum;
  }
}

template <class W>
BRACHY_INLINE void gram(const double* X, std::size_t stride, std::size_t n, const std::uint32_t* starts,
                        std::size_t m, double* H, std::size_t outer) {
  // H's column j from X's column j as the scalar and its rows as the vector: rows [c, c + two vectors), columns [j,
  // j + kRows).
  for (std::size_t j = 0; j < m; j += kRows) {
    const std::size_t columns = std::min(kRows, m - j);
    const std::size_t start_j = *std::min_element(starts + j, starts + j + columns);
    for (std::size_t c = j / W::kTogether * W::kTogether; c < m; c += W::kTogether) {
      const std::size_t rows = std::min(W::kTogether, m - c);
      const std::size_t start =
          std::max<std::size_t>(start_j, *std::min_element(starts + c, starts + c + rows));
      Tile<W, kRows> tile;
      accumulate<W, kRows>(X + j, stride, X + c, stride, start, n, tile);
      for (std::size_t q = 0; q < columns; ++q) {
        double values[W::kTogether];
        store(values, tile.sum[q][0]);
        store(values + W::kLanes, tile.sum[q][1]);
        const std::size_t first = std::max(c, j + q);
        for (std::size_t i = first; i < c + rows; ++i) H[(j + q) * outer + i] = values[i - c];
      }
    }
  }
}

// One copy of the loops for a target.
// NOLINTBEGIN(bugprone-macro-parentheses): an attribute or a template cannot stand in parentheses.
#define BRACHY_TARGET(name, attribute, bytes)                                                                \
  struct name {                                                                                              \
    using W = Width<bytes>;                                                                                  \
    attribute static void solve(const double* L, std::size_t outer, std::size_t n,                           \
                                const std::uint32_t* starts, double* X, std::size_t stride, std::size_t m) { \
      solve_lower<W>(L, outer, n, starts, X, stride, m);                                                     \
    }                                                                                                        \
    attribute static void square(const double* X, std::size_t stride, std::size_t n,                         \
                                 const std::uint32_t* starts, std::size_t m, double* H, std::size_t outer) { \
      gram<W>(X, stride, n, starts, m, H, outer);                                                            \
    }                                                                                                        \
    attribute static void solve_by_panels(const PanelMatrix& L, std::size_t first, std::size_t n,            \
                                          const std::uint32_t* starts, double* X, std::size_t stride,        \
                                          std::size_t m) {                                                   \
      solve_panels<W>(L, first, n, starts, X, stride, m);                                                    \
    }                                                                                                        \
    attribute static void add_square(const double* X, std::size_t stride, std::size_t first,                 \
                                     std::size_t end, const std::uint32_t* starts, std::size_t m, double* H, \
                                     std::size_t outer) {                                                    \
      add_gram<W>(X, stride, first, end, starts, m, H, outer);                                               \
    }                                                                                                        \
    attribute static void multiply(const double* A, std::size_t a_stride, const std::uint32_t* a_starts,     \
                                   std::size_t columns, const double* X, std::size_t stride,                 \
                                   const std::uint32_t* starts, std::size_t m, std::size_t n, double* Z,     \
                                   std::size_t z_stride) {                                                   \
      product<W>(A, a_stride, a_starts, columns, X, stride, starts, m, n, Z, z_stride);                      \
    }                                                                                                        \
    attribute static void project_one(const double* X, std::size_t stride, const std::uint32_t* starts,      \
                                      std::size_t m, const double* y, std::size_t n, double* sums) {         \
      project<W>(X, stride, starts, m, y, n, sums);                                                          \
    }                                                                                                        \
    attribute static void subtract_one(const double* X, std::size_t stride, const std::uint32_t* starts,     \
                                       std::size_t m, const double* sums, std::size_t n, double* y) {        \
      subtract<W>(X, stride, starts, m, sums, n, y);                                                         \
    }                                                                                                        \
    static constexpr InverseLoops kLoops{solve,       solve_by_panels, add_square, multiply,                 \
                                         project_one, subtract_one,    square};                              \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(Generic, , 16);
BRACHY_TARGET(Sse4, BRACHY_SSE4, 16);
BRACHY_TARGET(Avx2, BRACHY_AVX2, 32);
BRACHY_TARGET(Avx512, BRACHY_AVX512, 64);

}  // namespace

const InverseLoops& inverse_loops(SimdTarget target) {
  return loops_for(target, Generic::kLoops, Sse4::kLoops, Avx2::kLoops, Avx512::kLoops);
}

}  // namespace brachy
