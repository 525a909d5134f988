// Compiled with -ffp-contract=fast: where a target has FMA, a·b + c is one instruction.
#include "core/models/matrix_kernel/near_loops.h"

#include <algorithm>
#include <cstring>

#include "core/base/simd/simd_attributes.h"
#include "core/kernels/vector_rsqrt.h"

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;
// One register of a target: written out, because GCC 12 leaves some of these loops in scalars, and takes registers that
// the target does not have for longer ones.
template <std::size_t kWidth>
struct Register;
template <>
struct Register<4> {
  using Floats = float __attribute__((vector_size(16)));
  using Ints = std::int32_t __attribute__((vector_size(16)));
};
template <>
struct Register<8> {
  using Floats = float __attribute__((vector_size(32)));
  using Ints = std::int32_t __attribute__((vector_size(32)));
};
template <>
struct Register<16> {
  using Floats = float __attribute__((vector_size(64)));
  using Ints = std::int32_t __attribute__((vector_size(64)));
};
template <std::size_t kWidth>
using Floats = typename Register<kWidth>::Floats;

template <class R>
BRACHY_INLINE void load(const float* from, R& to) {
  std::memcpy(&to, from, sizeof to);
}
template <class R>
BRACHY_INLINE void store(const R& from, float* to) {
  std::memcpy(to, &from, sizeof from);
}

// 1/√x as vector_rsqrt.h, with two steps whose constants share the error out (C. J. Walczyk, L. V. Moroz, J. L.
// Cieśliński, Improving the accuracy of the fast inverse square root, 2021): within 8e-7.
template <std::size_t kWidth>
BRACHY_INLINE void take_rsqrt(const Floats<kWidth>& x, Floats<kWidth>& y) {
  using Ints = typename Register<kWidth>::Ints;
  y = (Floats<kWidth>)(0x5f376908 - ((Ints)x >> 1));
  const Floats<kWidth> h = 0.5f * x;
  y = y * (1.5008789f - h * y * y);
  y = y * (1.5000006f - h * y * y);
}

template <std::size_t kWidth, std::size_t kMany = kPoints>
BRACHY_INLINE void add_kelvin(const BlockPoints<float>& __restrict X, const NearSource* __restrict sources,
                              std::size_t count, float b, BlockDisplacement<float>& __restrict u) {
  // Registers of points: what fits with the sums.
  constexpr std::size_t kTogether = kWidth >= 16 && kMany > kWidth ? 2 : 1;
  using R = Floats<kWidth>;
  for (std::size_t first = 0; first < kMany; first += kTogether * kWidth) {
    R x[kTogether], y[kTogether], z[kTogether], ux[kTogether], uy[kTogether], uz[kTogether];
    for (std::size_t k = 0; k < kTogether; ++k) {
      const std::size_t at = first + k * kWidth;
      load(X.x + at, x[k]);
      load(X.y + at, y[k]);
      load(X.z + at, z[k]);
      load(u.ux + at, ux[k]);
      load(u.uy + at, uy[k]);
      load(u.uz + at, uz[k]);
    }
    for (std::size_t j = 0; j < count; ++j) {
      const NearSource p = sources[j];
      const float half_s = 0.5f * p.s;
#pragma GCC unroll 2
      for (std::size_t k = 0; k < kTogether; ++k) {
        const R dx = x[k] - p.x, dy = y[k] - p.y, dz = z[k] - p.z;
        const R d2 = dz * dz + (dy * dy + (dx * dx + p.s));
        R i1;
        take_rsqrt<kWidth>(d2, i1);
        const R i3 = i1 * i1 * i1;
        const R along = (b * i3) * (dx * p.fx + dy * p.fy + dz * p.fz);
        const R across = (1 - b) * i1 + half_s * i3;
        ux[k] = along * dx + (across * p.fx + ux[k]);
        uy[k] = along * dy + (across * p.fy + uy[k]);
        uz[k] = along * dz + (across * p.fz + uz[k]);
      }
    }
    for (std::size_t k = 0; k < kTogether; ++k) {
      const std::size_t at = first + k * kWidth;
      store(ux[k], u.ux + at);
      store(uy[k], u.uy + at);
      store(uz[k], u.uz + at);
    }
  }
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

template <class R>
BRACHY_INLINE void take_max(R& a, const R& b) {
  a = a > b ? a : b;
}
template <class R>
BRACHY_INLINE void take_min(R& a, const R& b) {
  a = a < b ? a : b;
}

// ∂u_i/∂x_j = f_i P x_j + x_i (Q f_j + S (x·f) x_j) + δ_ij Q (x·f), see above.
template <std::size_t kWidth>
BRACHY_INLINE void add_kelvin_gradients(const CellPoints& __restrict X, const NearSource* __restrict sources,
                                        std::size_t count, float b, CellGradients& __restrict A) {
  using R = Floats<kWidth>;
  for (std::size_t first = 0; first < CellPoints::kCount; first += kWidth) {
    R x, y, z, a[9], diagonal = {};
    load(X.x + first, x);
    load(X.y + first, y);
    load(X.z + first, z);
    for (std::size_t k = 0; k < 9; ++k) load(A.a[k] + first, a[k]);
    for (std::size_t j = 0; j < count; ++j) {
      const NearSource p = sources[j];
      const R dx = x - p.x, dy = y - p.y, dz = z - p.z;
      const R d2 = dx * dx + dy * dy + dz * dz + p.s;
      R i1;
      take_rsqrt<kWidth>(d2, i1);
      const R i2 = i1 * i1, i3 = i1 * i2;
      const R P = -i3 * ((1 - b) + 1.5f * p.s * i2), Q = b * i3;
      const R Q_dot = Q * (dx * p.fx + dy * p.fy + dz * p.fz), S_dot = -3 * i2 * Q_dot;
      const R P_x = P * dx, P_y = P * dy, P_z = P * dz;
      const R G_x = Q * p.fx + S_dot * dx, G_y = Q * p.fy + S_dot * dy, G_z = Q * p.fz + S_dot * dz;
      a[0] += p.fx * P_x + dx * G_x;
      a[1] += p.fx * P_y + dx * G_y;
      a[2] += p.fx * P_z + dx * G_z;
      a[3] += p.fy * P_x + dy * G_x;
      a[4] += p.fy * P_y + dy * G_y;
      a[5] += p.fy * P_z + dy * G_z;
      a[6] += p.fz * P_x + dz * G_x;
      a[7] += p.fz * P_y + dz * G_y;
      a[8] += p.fz * P_z + dz * G_z;
      diagonal += Q_dot;
    }
    for (std::size_t k = 0; k < 9; k += 4) a[k] += diagonal;
    for (std::size_t k = 0; k < 9; ++k) store(a[k], A.a[k] + first);
  }
}

// Of a coordinate, the square of how far the cell is from it.
template <class R>
BRACHY_INLINE void add_distance2(const R& at, float centre, float half, R& d2) {
  const R apart = at - centre;
  R beyond = (apart > 0.0f ? apart : -apart) - half;
  take_max(beyond, R{});
  d2 += beyond * beyond;
}

constexpr float kTiny = 1e-6f;  // mm²

// Sixteen sums, added up in one order on every target.
struct LaneSums {
  alignas(64) float lanes[BoundedForces::kCount];
  BRACHY_INLINE float total() const {
    float sum = 0;
    for (const float lane : lanes) sum += lane;
    return sum;
  }
};

// The square of the cell's distance from each of sixteen places.
template <std::size_t kWidth>
BRACHY_INLINE void take_distance2(const BoundedForces::Lanes& at_x, const BoundedForces::Lanes& at_y,
                                  const BoundedForces::Lanes& at_z, std::size_t lane, const BoundedCell& cell,
                                  Floats<kWidth>& d2) {
  Floats<kWidth> x, y, z;
  load(at_x.data() + lane, x);
  load(at_y.data() + lane, y);
  load(at_z.data() + lane, z);
  d2 = Floats<kWidth>{};
  add_distance2(x, cell.x, cell.half, d2);
  add_distance2(y, cell.y, cell.half, d2);
  add_distance2(z, cell.z, cell.half, d2);
}

// 1 for forces that count in the cell: of a piece that is far what stands for it, of a near one its rings.
template <std::size_t kWidth>
BRACHY_INLINE void take_counts(const BoundedForces& f, std::size_t lane, const BoundedCell& cell,
                               Floats<kWidth>& counts) {
  using R = Floats<kWidth>;
  const R zero = {}, one = zero + 1.0f;
  R far2, is_piece, d2;
  load(f.far2.data() + lane, far2);
  load(f.is_piece.data() + lane, is_piece);
  take_distance2<kWidth>(f.piece.x, f.piece.y, f.piece.z, lane, cell, d2);
  const R is_other = (d2 > far2 ? one : zero) - is_piece;
  counts = one - is_other * is_other;  // comparing two masks GCC 12 does lane by lane
}

// A ring of radius R is on average 1/√((q + R²)² − 4 R² ρ²) ≤ 1/(q − R²) in 1/d², q the distance² of its centre and ρ
// that of its axis; its six points do the same up to 2 (R/ρ)⁶. What is asked lies outside the needle.
// The cosine of the angle from a force to the cell's places is bounded by the cell's shadow on its direction.
template <std::size_t kWidth>
BRACHY_INLINE BoundSums add_kelvin_bounds(const BoundedForces* __restrict forces, std::size_t groups,
                                          const KelvinBounds& k, const BoundedCell& cell) {
  constexpr float kOverPi4 = 0.0795774715f;
  using R = Floats<kWidth>;
  constexpr std::size_t kParts = BoundedForces::kCount / kWidth;
  const R zero = {}, one = zero + 1.0f;
  LaneSums sums[3];  // slope, squeeze, shrink
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::size_t lane = part * kWidth;
    R slope = {}, squeeze = {}, shrink = {};
    for (std::size_t g = 0; g < groups; ++g) {
      const BoundedForces& f = forces[g];
      R x, y, z, s, ring2, size, fx, fy, fz, aside, cubed, counts, d2;
      load(f.x.data() + lane, x);
      load(f.y.data() + lane, y);
      load(f.z.data() + lane, z);
      load(f.s.data() + lane, s);
      load(f.ring2.data() + lane, ring2);
      load(f.size.data() + lane, size);
      load(f.fx.data() + lane, fx);
      load(f.fy.data() + lane, fy);
      load(f.fz.data() + lane, fz);
      load(f.aside.data() + lane, aside);
      load(f.cubed.data() + lane, cubed);
      take_counts<kWidth>(f, lane, cell, counts);
      size *= counts;
      take_distance2<kWidth>(f.x, f.y, f.z, lane, cell, d2);
      R asked2 = ring2 > 0.0f ? zero + cell.clearance2 : zero;
      take_max(asked2, d2);
      asked2 -= ring2;
      take_max<R>(asked2, zero + kTiny);
      R inverse_distance;
      take_rsqrt<kWidth>(asked2, inverse_distance);
      const R inverse = 1.0f / (asked2 + s), spread = 1.5f * s * inverse;
      const R middle = (cell.x - x) * fx + (cell.y - y) * fy + (cell.z - z) * fz;
      const R reach =
          cell.half * ((fx > 0.0f ? fx : -fx) + (fy > 0.0f ? fy : -fy) + (fz > 0.0f ? fz : -fz)) + aside;
      R behind = -(cubed * (middle - reach) * inverse_distance),
        ahead = cubed * (middle + reach) * inverse_distance;
      for (R* cosine : {&behind, &ahead}) {
        take_max(*cosine, zero);
        take_min(*cosine, one);
      }
      const R steepest = ahead > behind ? ahead : behind;
      const R skew = 0.5f * (k.shrink + spread * kOverPi4) * (1.0f + steepest);
      R turned = 2.0f * ahead;
      take_max(turned, behind);
      R squeezed = skew + k.stretch * turned;
      take_min<R>(squeezed, zero + k.squeeze);
      const R there = size * inverse;
      slope += k.slope * there;
      squeeze += squeezed * there;
      shrink += k.shrink * (1.0f + spread) * steepest * there;
    }
    store(slope, sums[0].lanes + lane);
    store(squeeze, sums[1].lanes + lane);
    store(shrink, sums[2].lanes + lane);
  }
  return {sums[0].total(), sums[1].total(), sums[2].total()};
}

// What is interpolated may lie in a needle: there the mean of 1/d⁴ is (q + R²)/(q − R²)³ at most, and near to the ring
// nothing is.
template <std::size_t kWidth>
BRACHY_INLINE CurvatureSums add_kelvin_curvatures(const BoundedForces* __restrict forces, std::size_t groups,
                                                  const KelvinBounds& k, const BoundedCell& cell) {
  constexpr float kInfinite = 1e30f;
  using R = Floats<kWidth>;
  constexpr std::size_t kParts = BoundedForces::kCount / kWidth;
  const R zero = {}, one = zero + 1.0f;
  LaneSums sums[2];  // curvature, work
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::size_t lane = part * kWidth;
    R curvature = {}, work = {};
    for (std::size_t g = 0; g < groups; ++g) {
      const BoundedForces& f = forces[g];
      R s, ring2, size, points, counts, d2;
      load(f.s.data() + lane, s);
      load(f.ring2.data() + lane, ring2);
      load(f.size.data() + lane, size);
      load(f.points.data() + lane, points);
      take_counts<kWidth>(f, lane, cell, counts);
      take_distance2<kWidth>(f.x, f.y, f.z, lane, cell, d2);
      R inner = d2 - ring2;
      const R is_near = inner < 3.0f * ring2 ? one : zero;
      take_max<R>(inner, zero + kTiny);
      const R inverse2 = 1.0f / ((inner + s) * (inner + s));
      curvature +=
          counts * size * ((1.0f + 2.0f * ring2 / inner) * k.curvature * inverse2 + is_near * kInfinite);
      work += counts * (d2 > cell.far2 ? one : points);
    }
    store(curvature, sums[0].lanes + lane);
    store(work, sums[1].lanes + lane);
  }
  return {sums[0].total(), sums[1].total()};
}

// Of sixteen corrections 1/(d² + s) of both their forces, and of what is left of both.
template <std::size_t kWidth>
BRACHY_INLINE void take_correction(const BoundedCorrections& c, std::size_t lane, const BoundedCell& cell,
                                   Floats<kWidth>& size, Floats<kWidth>& inverse, Floats<kWidth>& other,
                                   Floats<kWidth>& both) {
  Floats<kWidth> s, counter_s, d2;
  load(c.s.data() + lane, s);
  load(c.counter_s.data() + lane, counter_s);
  load(c.size.data() + lane, size);
  take_distance2<kWidth>(c.x, c.y, c.z, lane, cell, d2);
  inverse = 1.0f / (d2 + s);
  other = 1.0f / (d2 + counter_s);
  both = s * inverse * inverse;
}

template <std::size_t kWidth>
BRACHY_INLINE BoundSums add_correction_bounds(const BoundedCorrections* __restrict corrections,
                                              std::size_t groups, const KelvinBounds& k,
                                              const BoundedCell& cell) {
  using R = Floats<kWidth>;
  constexpr std::size_t kParts = BoundedCorrections::kCount / kWidth;
  LaneSums sums[2];  // slope, squeeze
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::size_t lane = part * kWidth;
    R slope = {}, squeeze = {};
    for (std::size_t g = 0; g < groups; ++g) {
      R size, inverse, other, both;
      take_correction<kWidth>(corrections[g], lane, cell, size, inverse, other, both);
      R steep = k.slope * (inverse + other), squeezed = k.squeeze * (inverse + other);
      take_min<R>(steep, k.pair_slope * both);
      take_min<R>(squeezed, k.pair_squeeze * both);
      slope += size * steep;
      squeeze += size * squeezed;
    }
    store(slope, sums[0].lanes + lane);
    store(squeeze, sums[1].lanes + lane);
  }
  // A correction's divergence is no more than its slope.
  return {sums[0].total(), sums[1].total(), sums[0].total()};
}

template <std::size_t kWidth>
BRACHY_INLINE float add_correction_curvatures(const BoundedCorrections* __restrict corrections,
                                              std::size_t groups, const KelvinBounds& k,
                                              const BoundedCell& cell) {
  using R = Floats<kWidth>;
  constexpr std::size_t kParts = BoundedCorrections::kCount / kWidth;
  LaneSums sums;
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::size_t lane = part * kWidth;
    R curvature = {};
    for (std::size_t g = 0; g < groups; ++g) {
      R size, inverse, other, both;
      take_correction<kWidth>(corrections[g], lane, cell, size, inverse, other, both);
      R curved = k.curvature * (inverse * inverse + other * other);
      take_min<R>(curved, k.pair_curvature * both * inverse);
      curvature += size * curved;
    }
    store(curvature, sums.lanes + lane);
  }
  return sums.total();
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

BRACHY_INLINE void quadratic_loop(const BlockPoints<float>& __restrict X, const float (*__restrict q)[3],
                                  BlockDisplacement<float>& __restrict u) {
  float* const planes[3] = {u.ux, u.uy, u.uz};
  for (std::size_t k = 0; k < 3; ++k) {
    float* __restrict out = planes[k];
    const float c = q[0][k], x1 = q[1][k], y1 = q[2][k], z1 = q[3][k], xx = q[4][k], yy = q[5][k],
                zz = q[6][k], xy = q[7][k], yz = q[8][k], zx = q[9][k];
    for (std::size_t i = 0; i < kPoints; ++i) {
      const float x = X.x[i], y = X.y[i], z = X.z[i];
      out[i] = c + x * (x1 + xx * x + xy * y) + y * (y1 + yy * y + yz * z) + z * (z1 + zz * z + zx * x);
    }
  }
}

BRACHY_INLINE void axpy_loop(float a, const float* __restrict x, float* __restrict y, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) y[i] += a * x[i];
}

// NOLINTBEGIN(bugprone-macro-parentheses): an attribute or a template cannot stand in parentheses.
#define BRACHY_NEAR_LOOPS(Name, Target, kWidth)                                                             \
  struct Name {                                                                                             \
    Target static void kelvin(const BlockPoints<float>& X, const NearSource* s, std::size_t n, float b,     \
                              BlockDisplacement<float>& u) {                                                \
      add_kelvin<kWidth>(X, s, n, b, u);                                                                    \
    }                                                                                                       \
    Target static void kelvin_few(const BlockPoints<float>& X, const NearSource* s, std::size_t n, float b, \
                                  BlockDisplacement<float>& u) {                                            \
      add_kelvin<kWidth, NearLoops::kFew>(X, s, n, b, u);                                                   \
    }                                                                                                       \
    Target static void compact(const BlockPoints<float>& X, const NearSource* s, std::size_t n,             \
                               const CompactShape& shape, BlockDisplacement<float>& u) {                    \
      add_compact(X, s, n, shape, u);                                                                       \
    }                                                                                                       \
    Target static void kelvin_gradients(const CellPoints& X, const NearSource* s, std::size_t n, float b,   \
                                        CellGradients& A) {                                                 \
      add_kelvin_gradients<kWidth>(X, s, n, b, A);                                                          \
    }                                                                                                       \
    Target static void compact_gradients(const CellPoints& X, const NearSource* s, std::size_t n,           \
                                         const CompactShape& shape, CellGradients& A) {                     \
      add_compact_gradients(X, s, n, shape, A);                                                             \
    }                                                                                                       \
    Target static BoundSums kelvin_bounds(const BoundedForces* f, std::size_t n, const KelvinBounds& k,     \
                                          const BoundedCell& cell) {                                        \
      return add_kelvin_bounds<kWidth>(f, n, k, cell);                                                      \
    }                                                                                                       \
    Target static BoundSums correction_bounds(const BoundedCorrections* c, std::size_t n,                   \
                                              const KelvinBounds& k, const BoundedCell& cell) {             \
      return add_correction_bounds<kWidth>(c, n, k, cell);                                                  \
    }                                                                                                       \
    Target static CurvatureSums kelvin_curvatures(const BoundedForces* f, std::size_t n,                    \
                                                  const KelvinBounds& k, const BoundedCell& cell) {         \
      return add_kelvin_curvatures<kWidth>(f, n, k, cell);                                                  \
    }                                                                                                       \
    Target static float correction_curvatures(const BoundedCorrections* c, std::size_t n,                   \
                                              const KelvinBounds& k, const BoundedCell& cell) {             \
      return add_correction_curvatures<kWidth>(c, n, k, cell);                                              \
    }                                                                                                       \
    Target static void interpolate(const float* values, std::size_t row, std::size_t slice,                 \
                                   const GridPoint* points, std::size_t count,                              \
                                   BlockDisplacement<float>& u) {                                           \
      interpolate_loop(values, row, slice, points, count, u);                                               \
    }                                                                                                       \
    Target static void quadratic(const BlockPoints<float>& X, const float (*q)[3],                          \
                                 BlockDisplacement<float>& u) {                                             \
      quadratic_loop(X, q, u);                                                                              \
    }                                                                                                       \
    Target static void axpy(float a, const float* x, float* y, std::size_t n) { axpy_loop(a, x, y, n); }    \
    static constexpr NearLoops kLoops = {kelvin,                                                            \
                                         kelvin_few,                                                        \
                                         compact,                                                           \
                                         kelvin_gradients,                                                  \
                                         compact_gradients,                                                 \
                                         kelvin_bounds,                                                     \
                                         correction_bounds,                                                 \
                                         kelvin_curvatures,                                                 \
                                         correction_curvatures,                                             \
                                         interpolate,                                                       \
                                         quadratic,                                                         \
                                         axpy};                                                             \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_NEAR_LOOPS(Generic, , 4);
BRACHY_NEAR_LOOPS(Sse4, BRACHY_SSE4, 4);
BRACHY_NEAR_LOOPS(Avx2, BRACHY_AVX2, 8);
BRACHY_NEAR_LOOPS(Avx512, BRACHY_AVX512, 16);

}  // namespace

const NearLoops& near_loops(SimdTarget target) {
  return loops_for(target, Generic::kLoops, Sse4::kLoops, Avx2::kLoops, Avx512::kLoops);
}

}  // namespace brachy
