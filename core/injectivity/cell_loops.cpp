// Compiled with -ffp-contract=fast: where a target has FMA, a·b + c is one instruction.
#include "core/injectivity/cell_loops.h"

#include <algorithm>
#include <cmath>

#include "core/base/simd/simd_attributes.h"

namespace brachy {
namespace {

constexpr std::size_t kPoints = CellPoints::kCount, kTogether = 4;
constexpr std::size_t kLanes = 16;  // the first points of the eighths lie among so many

template <class K, std::size_t kCount>
BRACHY_INLINE void add_sources(const CellPoints& __restrict X, const CellSource* __restrict sources,
                               float inverse_radius, CellGradients& __restrict A) {
  CellSource p[kCount];
  for (std::size_t j = 0; j < kCount; ++j) p[j] = sources[j];
  for (std::size_t i = 0; i < kPoints; ++i) {
    float a[9];
    for (std::size_t k = 0; k < 9; ++k) a[k] = A.a[k][i];
#pragma GCC unroll 4
    for (std::size_t j = 0; j < kCount; ++j) {
      const float dx = X.x[i] - p[j].x, dy = X.y[i] - p[j].y, dz = X.z[i] - p[j].z;
      const float r = std::sqrt(dx * dx + dy * dy + dz * dz) * inverse_radius;
      const float c = K::inside_over_r(r < 1.0f ? r : 1.0f);
      const float gx = c * dx, gy = c * dy, gz = c * dz;
      a[0] += p[j].wx * gx;
      a[1] += p[j].wx * gy;
      a[2] += p[j].wx * gz;
      a[3] += p[j].wy * gx;
      a[4] += p[j].wy * gy;
      a[5] += p[j].wy * gz;
      a[6] += p[j].wz * gx;
      a[7] += p[j].wz * gy;
      a[8] += p[j].wz * gz;
    }
    for (std::size_t k = 0; k < 9; ++k) A.a[k][i] = a[k];
  }
}

template <class K>
BRACHY_INLINE void gradients(const CellPoints& X, const CellSource* sources, std::size_t count,
                             float inverse_radius, CellGradients& A) {
  A = {};
  std::size_t j = 0;
  for (; j + kTogether <= count; j += kTogether) add_sources<K, kTogether>(X, sources + j, inverse_radius, A);
  for (; j < count; ++j) add_sources<K, 1>(X, sources + j, inverse_radius, A);
}

BRACHY_INLINE void distances(const CellPlaces& p, const std::uint32_t* __restrict chosen, std::size_t count,
                             float x, float y, float z, float half, float* __restrict distance) {
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t i = chosen[k];
    const float dx = std::max(std::abs(p.x[i] - x) - half, 0.0f),
                dy = std::max(std::abs(p.y[i] - y) - half, 0.0f),
                dz = std::max(std::abs(p.z[i] - z) - half, 0.0f);
    distance[k] = std::sqrt(dx * dx + dy * dy + dz * dz);
  }
}

BRACHY_INLINE float determinant(const float* m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

BRACHY_INLINE void determinants(const CellGradients& __restrict A, float scale, float* __restrict det) {
  for (std::size_t i = 0; i < kPoints; ++i) {
    float m[9];
    for (std::size_t k = 0; k < 9; ++k) m[k] = scale * A.a[k][i];
    m[0] += 1;
    m[4] += 1;
    m[8] += 1;
    det[i] = determinant(m);
  }
}

// In an eighth, I + s∇u = M + E + R with M the mean over its corners, E = Σ λ_j E_j, λ_j ≥ 0 of sum 1, and R of nuclear
// norm |R|₁ ≤ ρ. With C = adj M, D = det M > 0, X = C (E + R):
//
//   det(M + E + R) = D + tr X + e₂(X)/D + det(X)/D²,   e₂(X) ≥ −|X|²/2,   |det X| ≤ (|X|/√3)³
//
// where |X| ≤ max_j |C E_j| + |C|₂ ρ (Frobenius norms) and tr X ≥ min_j tr(C E_j) − |C|₂ ρ; |C|₂² ≤ |C|₁ |C|_∞, the
// largest sums of a column and a row. A source with a cusp adds s gᵀ adj(M + E + R) w, which is at least
// −s |g| (|C w| + |w| (2|M| |E + R| + |E + R|²)/√3), adj being quadratic with |adj M| ≤ |M|²/√3.
BRACHY_INLINE void bounds(const CellGradients& __restrict A, const CellRemainder& __restrict q,
                          float* __restrict lower) {
  alignas(64) float mean[9][kLanes], C[9][kLanes], D[kLanes], trace[kLanes], x2[kLanes], e2[kLanes];
  for (std::size_t k = 0; k < 9; ++k)
    for (std::size_t i = 0; i < kLanes; ++i) {
      float sum = 0;
#pragma GCC unroll 8
      for (std::size_t j = 0; j < 8; ++j) sum += A.a[k][i + kCorners[j]];
      mean[k][i] = 0.125f * sum;
    }
  for (std::size_t i = 0; i < kLanes; ++i) {
    float m[9];
    for (std::size_t k = 0; k < 9; ++k) m[k] = q.scale * mean[k][i];
    m[0] += 1;
    m[4] += 1;
    m[8] += 1;
    C[0][i] = m[4] * m[8] - m[5] * m[7];
    C[1][i] = m[2] * m[7] - m[1] * m[8];
    C[2][i] = m[1] * m[5] - m[2] * m[4];
    C[3][i] = m[5] * m[6] - m[3] * m[8];
    C[4][i] = m[0] * m[8] - m[2] * m[6];
    C[5][i] = m[2] * m[3] - m[0] * m[5];
    C[6][i] = m[3] * m[7] - m[4] * m[6];
    C[7][i] = m[1] * m[6] - m[0] * m[7];
    C[8][i] = m[0] * m[4] - m[1] * m[3];
    D[i] = m[0] * C[0][i] + m[1] * C[3][i] + m[2] * C[6][i];
    trace[i] = 1e30f;
    x2[i] = 0;
    e2[i] = 0;
  }
  for (const std::size_t corner : kCorners)
    for (std::size_t i = 0; i < kLanes; ++i) {
      float e[9], norm = 0, xx = 0;
#pragma GCC unroll 9
      for (std::size_t k = 0; k < 9; ++k) {
        e[k] = q.scale * (A.a[k][i + corner] - mean[k][i]);
        norm += e[k] * e[k];
      }
      float t = 0;
#pragma GCC unroll 3
      for (std::size_t r = 0; r < 3; ++r)
#pragma GCC unroll 3
        for (std::size_t c = 0; c < 3; ++c) {
          const float x = C[3 * r][i] * e[c] + C[3 * r + 1][i] * e[3 + c] + C[3 * r + 2][i] * e[6 + c];
          xx += x * x;
          if (r == c) t += x;
        }
      trace[i] = std::min(trace[i], t);
      x2[i] = std::max(x2[i], xx);
      e2[i] = std::max(e2[i], norm);
    }
  const float rho = q.scale * q.error;
  const float w2 = q.wx * q.wx + q.wy * q.wy + q.wz * q.wz, w = std::sqrt(w2), g = q.scale * q.cusp_slope;
  for (std::size_t i = 0; i < kLanes; ++i) {
    float m2 = 0, rows = 0, columns = 0;
#pragma GCC unroll 9
    for (std::size_t k = 0; k < 9; ++k) {
      const float m = q.scale * mean[k][i] + (k % 4 == 0 ? 1.0f : 0.0f);
      m2 += m * m;
    }
#pragma GCC unroll 3
    for (std::size_t k = 0; k < 3; ++k) {
      rows = std::max(rows, std::abs(C[3 * k][i]) + std::abs(C[3 * k + 1][i]) + std::abs(C[3 * k + 2][i]));
      columns = std::max(columns, std::abs(C[k][i]) + std::abs(C[k + 3][i]) + std::abs(C[k + 6][i]));
    }
    const float c = std::sqrt(rows * columns), m = std::sqrt(m2), e = std::sqrt(e2[i]) + rho;
    const float X = std::sqrt(x2[i]) + c * rho, X2 = X * X, inverse = 1 / std::max(D[i], 1e-6f);
    float cw2 = 0;
#pragma GCC unroll 3
    for (std::size_t r = 0; r < 3; ++r) {
      const float v = C[3 * r][i] * q.wx + C[3 * r + 1][i] * q.wy + C[3 * r + 2][i] * q.wz;
      cw2 += v * v;
    }
    const float cusp = g * (std::sqrt(cw2) + w * (2 * m * e + e * e) * 0.57735027f);
    const float rounding = 4e-6f * (1 + m2 * m);
    lower[i] = D[i] + trace[i] - c * rho - 0.5f * X2 * inverse - 0.19245009f * X2 * X * inverse * inverse -
               cusp - rounding;
    lower[i] = D[i] > 1e-6f ? lower[i] : -1.0f;
  }
}

// NOLINTBEGIN(bugprone-macro-parentheses): an attribute cannot stand in parentheses.
#define BRACHY_TARGET(name, attribute)                                                                       \
  struct name {                                                                                              \
    template <class K>                                                                                       \
    attribute static void run_gradients(const CellPoints& X, const CellSource* sources, std::size_t count,   \
                                        float inverse_radius, CellGradients& A) {                            \
      gradients<K>(X, sources, count, inverse_radius, A);                                                    \
    }                                                                                                        \
    attribute static void run_distances(const CellPlaces& places, const std::uint32_t* chosen,               \
                                        std::size_t count, float x, float y, float z, float half,            \
                                        float* distance) {                                                   \
      distances(places, chosen, count, x, y, z, half, distance);                                             \
    }                                                                                                        \
    attribute static void run_determinants(const CellGradients& A, float scale, float* det) {                \
      determinants(A, scale, det);                                                                           \
    }                                                                                                        \
    attribute static void run_bounds(const CellGradients& A, const CellRemainder& remainder, float* lower) { \
      bounds(A, remainder, lower);                                                                           \
    }                                                                                                        \
    static constexpr CellLoops kLoops{run_distances, run_determinants, run_bounds};                          \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(Generic, );
BRACHY_TARGET(Sse4, BRACHY_SSE4);
BRACHY_TARGET(Avx2, BRACHY_AVX2);
BRACHY_TARGET(Avx512, BRACHY_AVX512);

}  // namespace

const CellLoops& cell_loops(SimdTarget target) {
  return loops_for(target, Generic::kLoops, Sse4::kLoops, Avx2::kLoops, Avx512::kLoops);
}

ScalarGradients scalar_gradients(const Kernel& kernel, SimdTarget target) {
  return std::visit(
      [&]<class K>(K) -> ScalarGradients {
        switch (target) {
          case SimdTarget::kSse4:
            return Sse4::run_gradients<K>;
          case SimdTarget::kAvx2:
            return Avx2::run_gradients<K>;
          case SimdTarget::kAvx512:
            return Avx512::run_gradients<K>;
          case SimdTarget::kGeneric:
            break;
        }
        return Generic::run_gradients<K>;
      },
      kernel);
}

}  // namespace brachy
