// Compiled with -ffp-contract=fast: where a target has FMA, a·b + c is one instruction.
#include "core/models/matrix_kernel/near_loops.h"

#include <algorithm>
#include <cstring>

#include "core/base/simd/simd_attributes.h"
#include "core/kernels/vector_rsqrt.h"

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;
constexpr std::size_t kTogether = 4;  // sources for each pass over the points

struct Sum {
  float x = 0, y = 0, z = 0;
};

struct Kelvin {
  float b;

  BRACHY_INLINE void add(float x, float y, float z, const NearSource& p, Sum& u) const {
    const float dx = x - p.x, dy = y - p.y, dz = z - p.z;
    const float i1 = vector_rsqrt(dx * dx + dy * dy + dz * dz + p.s);
    const float i3 = i1 * i1 * i1;
    const float along = b * i3 * (dx * p.fx + dy * p.fy + dz * p.fz);
    const float across = (1 - b) * i1 + 0.5f * p.s * i3;
    u.x += across * p.fx + along * dx;
    u.y += across * p.fy + along * dy;
    u.z += across * p.fz + along * dz;
  }
};

template <std::size_t kCount, class K>
BRACHY_INLINE void add_sources(const BlockPoints<float>& __restrict X, const NearSource* __restrict sources,
                               const K& kernel, BlockDisplacement<float>& __restrict u) {
  NearSource p[kCount];
  for (std::size_t j = 0; j < kCount; ++j) p[j] = sources[j];
  for (std::size_t i = 0; i < kPoints; ++i) {
    Sum sum{u.ux[i], u.uy[i], u.uz[i]};
#pragma GCC unroll 4
    for (std::size_t j = 0; j < kCount; ++j) kernel.add(X.x[i], X.y[i], X.z[i], p[j], sum);
    u.ux[i] = sum.x;
    u.uy[i] = sum.y;
    u.uz[i] = sum.z;
  }
}

template <class K>
BRACHY_INLINE void add_all(const BlockPoints<float>& X, const NearSource* sources, std::size_t count,
                           const K& kernel, BlockDisplacement<float>& u) {
  std::size_t j = 0;
  for (; j + kTogether <= count; j += kTogether) add_sources<kTogether>(X, sources + j, kernel, u);
  for (; j < count; ++j) add_sources<1>(X, sources + j, kernel, u);
}

// One source after the other, and its supports in loops over the points: so each loop vectorises.
BRACHY_INLINE void add_compact(const BlockPoints<float>& __restrict X, const NearSource* __restrict sources,
                               std::size_t count, const CompactShape& shape,
                               BlockDisplacement<float>& __restrict u) {
  alignas(64) float dx[kPoints], dy[kPoints], dz[kPoints], distance[kPoints], across[kPoints], along[kPoints];
  for (std::size_t j = 0; j < count; ++j) {
    const NearSource p = sources[j];
    for (std::size_t i = 0; i < kPoints; ++i) {
      dx[i] = X.x[i] - p.x;
      dy[i] = X.y[i] - p.y;
      dz[i] = X.z[i] - p.z;
      const float r2 = dx[i] * dx[i] + dy[i] * dy[i] + dz[i] * dz[i];
      distance[i] = r2 * vector_rsqrt(r2 + 1e-30f);
      across[i] = along[i] = 0;
    }
    for (std::size_t k = 0; k < shape.count; ++k) {
      const float inverse = shape.inverse_radius[k], w = shape.w[k], v = shape.v[k];
      const float outer = 15 * inverse * inverse * v;
      for (std::size_t i = 0; i < kPoints; ++i) {
        const float r = distance[i] * inverse < 1.0f ? distance[i] * inverse : 1.0f;
        const float t = 1 - r, t2 = t * t, t4 = t2 * t2;
        across[i] += t4 * (w * (1 + 4 * r) + v * (1 + 4 * r - 20 * r * r));
        along[i] += t4 * outer;
      }
    }
    for (std::size_t i = 0; i < kPoints; ++i) {
      const float dot = along[i] * (dx[i] * p.fx + dy[i] * p.fy + dz[i] * p.fz);
      u.ux[i] += across[i] * p.fx + dot * dx[i];
      u.uy[i] += across[i] * p.fy + dot * dy[i];
      u.uz[i] += across[i] * p.fz + dot * dz[i];
    }
  }
}

// u = φ f + χ x (x·f) has ∂u_i/∂x_j = P f_i x_j + Q (x_i f_j + δ_ij x·f) + S x_i x_j (x·f), P = φ′/r, Q = χ, S = χ′/r.
BRACHY_INLINE void add_gradient(float x, float y, float z, const NearSource& p, float P, float Q, float S,
                                std::size_t i, CellGradients& __restrict A) {
  const float dot = x * p.fx + y * p.fy + z * p.fz, S_dot = S * dot, Q_dot = Q * dot;
  const float P_x = P * x, P_y = P * y, P_z = P * z, Q_x = Q * x, Q_y = Q * y, Q_z = Q * z;
  A.a[0][i] += p.fx * P_x + Q_x * p.fx + Q_dot + S_dot * x * x;
  A.a[1][i] += p.fx * P_y + Q_x * p.fy + S_dot * x * y;
  A.a[2][i] += p.fx * P_z + Q_x * p.fz + S_dot * x * z;
  A.a[3][i] += p.fy * P_x + Q_y * p.fx + S_dot * y * x;
  A.a[4][i] += p.fy * P_y + Q_y * p.fy + Q_dot + S_dot * y * y;
  A.a[5][i] += p.fy * P_z + Q_y * p.fz + S_dot * y * z;
  A.a[6][i] += p.fz * P_x + Q_z * p.fx + S_dot * z * x;
  A.a[7][i] += p.fz * P_y + Q_z * p.fy + S_dot * z * y;
  A.a[8][i] += p.fz * P_z + Q_z * p.fz + Q_dot + S_dot * z * z;
}

BRACHY_INLINE void add_kelvin_gradients(const CellPoints& __restrict X, const NearSource* __restrict sources,
                                        std::size_t count, float b, CellGradients& __restrict A) {
  for (std::size_t j = 0; j < count; ++j) {
    const NearSource p = sources[j];
    for (std::size_t i = 0; i < CellPoints::kCount; ++i) {
      const float dx = X.x[i] - p.x, dy = X.y[i] - p.y, dz = X.z[i] - p.z;
      const float i1 = vector_rsqrt(dx * dx + dy * dy + dz * dz + p.s), i2 = i1 * i1, i3 = i1 * i2;
      add_gradient(dx, dy, dz, p, -i3 * ((1 - b) + 1.5f * p.s * i2), b * i3, -3 * b * i3 * i2, i, A);
    }
  }
}

BRACHY_INLINE void add_compact_gradients(const CellPoints& __restrict X, const NearSource* __restrict sources,
                                         std::size_t count, const CompactShape& shape,
                                         CellGradients& __restrict A) {
  constexpr std::size_t kCellPoints = CellPoints::kCount;
  alignas(64) float dx[kCellPoints], dy[kCellPoints], dz[kCellPoints], distance[kCellPoints], P[kCellPoints],
      Q[kCellPoints], S[kCellPoints];
  for (std::size_t j = 0; j < count; ++j) {
    const NearSource p = sources[j];
    for (std::size_t i = 0; i < kCellPoints; ++i) {
      dx[i] = X.x[i] - p.x;
      dy[i] = X.y[i] - p.y;
      dz[i] = X.z[i] - p.z;
      const float r2 = dx[i] * dx[i] + dy[i] * dy[i] + dz[i] * dz[i];
      distance[i] = r2 * vector_rsqrt(r2 + 1e-30f);
      P[i] = Q[i] = S[i] = 0;
    }
    for (std::size_t k = 0; k < shape.count; ++k) {
      const float inverse = shape.inverse_radius[k], inverse2 = inverse * inverse, w = shape.w[k],
                  v = shape.v[k];
      for (std::size_t i = 0; i < kCellPoints; ++i) {
        const float r = distance[i] * inverse < 1.0f ? distance[i] * inverse : 1.0f;
        const float t = 1 - r, t3 = t * t * t;
        P[i] -= inverse2 * t3 * (20 * w + 60 * v * (1 - 2 * r));
        Q[i] += 15 * inverse2 * v * t3 * t;
        S[i] -= 60 * inverse2 * inverse2 * v * t3 / (r > 1e-6f ? r : 1e-6f);
      }
    }
    for (std::size_t i = 0; i < kCellPoints; ++i)
      add_gradient(dx[i], dy[i], dz[i], p, P[i], Q[i], S[i], i, A);
  }
}

// A run of 16 floats in one register, or in what the target has: written out, because GCC 12 leaves a loop over them in
// scalars.
using Run = float __attribute__((vector_size(64)));

// 16 rows of four nodes, each a run of 12 floats: sums along the run, then x's weights.
BRACHY_INLINE void interpolate_loop(const float* __restrict values, std::size_t row, std::size_t slice,
                                    const GridPoint* __restrict points, std::size_t count,
                                    BlockDisplacement<float>& __restrict u) {
  for (std::size_t i = 0; i < count; ++i) {
    const GridPoint& p = points[i];
    Run sum = {};
    for (std::size_t z = 0; z < 4; ++z)
      for (std::size_t y = 0; y < 4; ++y) {
        Run v;
        std::memcpy(&v, values + 3 * static_cast<std::size_t>(p.base) + z * slice + y * row, sizeof v);
        sum += p.wz[z] * p.wy[y] * v;
      }
    alignas(64) float run[16];
    std::memcpy(run, &sum, sizeof run);
    u.ux[i] = p.wx[0] * run[0] + p.wx[1] * run[3] + p.wx[2] * run[6] + p.wx[3] * run[9];
    u.uy[i] = p.wx[0] * run[1] + p.wx[1] * run[4] + p.wx[2] * run[7] + p.wx[3] * run[10];
    u.uz[i] = p.wx[0] * run[2] + p.wx[1] * run[5] + p.wx[2] * run[8] + p.wx[3] * run[11];
  }
}

BRACHY_INLINE void axpy_loop(float a, const float* __restrict x, float* __restrict y, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) y[i] += a * x[i];
}

// NOLINTBEGIN(bugprone-macro-parentheses): an attribute or a template cannot stand in parentheses.
#define BRACHY_NEAR_LOOPS(Name, Target)                                                                   \
  struct Name {                                                                                           \
    Target static void kelvin(const BlockPoints<float>& X, const NearSource* s, std::size_t n, float b,   \
                              BlockDisplacement<float>& u) {                                              \
      add_all(X, s, n, Kelvin{b}, u);                                                                     \
    }                                                                                                     \
    Target static void compact(const BlockPoints<float>& X, const NearSource* s, std::size_t n,           \
                               const CompactShape& shape, BlockDisplacement<float>& u) {                  \
      add_compact(X, s, n, shape, u);                                                                     \
    }                                                                                                     \
    Target static void kelvin_gradients(const CellPoints& X, const NearSource* s, std::size_t n, float b, \
                                        CellGradients& A) {                                               \
      add_kelvin_gradients(X, s, n, b, A);                                                                \
    }                                                                                                     \
    Target static void compact_gradients(const CellPoints& X, const NearSource* s, std::size_t n,         \
                                         const CompactShape& shape, CellGradients& A) {                   \
      add_compact_gradients(X, s, n, shape, A);                                                           \
    }                                                                                                     \
    Target static void interpolate(const float* values, std::size_t row, std::size_t slice,               \
                                   const GridPoint* points, std::size_t count,                            \
                                   BlockDisplacement<float>& u) {                                         \
      interpolate_loop(values, row, slice, points, count, u);                                             \
    }                                                                                                     \
    Target static void axpy(float a, const float* x, float* y, std::size_t n) { axpy_loop(a, x, y, n); }  \
    static constexpr NearLoops kLoops = {kelvin,      compact, kelvin_gradients, compact_gradients,       \
                                         interpolate, axpy};                                              \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_NEAR_LOOPS(Generic, );
BRACHY_NEAR_LOOPS(Sse4, BRACHY_SSE4);
BRACHY_NEAR_LOOPS(Avx2, BRACHY_AVX2);
BRACHY_NEAR_LOOPS(Avx512, BRACHY_AVX512);

}  // namespace

const NearLoops& near_loops(SimdTarget target) {
  return loops_for(target, Generic::kLoops, Sse4::kLoops, Avx2::kLoops, Avx512::kLoops);
}

}  // namespace brachy
