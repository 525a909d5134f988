// Compiled with -ffp-contract=fast: where a target has FMA, a·b + c is one instruction.
#include "core/models/blocks/block_kernels.h"

#include <algorithm>
#include <cmath>

#include "core/base/simd/simd_attributes.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;
constexpr std::size_t kTogether = 4;  // columns for each pass over the points: their sums stay in registers

template <class K, class T>
BRACHY_INLINE T psi(T dx, T dy, T dz) {
  const T r = std::sqrt(dx * dx + dy * dy + dz * dz);
  return K::inside(r < T(1) ? r : T(1));
}

template <class K, class T, std::size_t kRun, std::size_t kCount, bool kFirst>
BRACHY_INLINE void add_landmarks(const BlockPoints<T>& __restrict X, std::size_t first,
                                 const LocalLandmark<T>* __restrict landmarks,
                                 const std::uint32_t* __restrict chosen, BlockDisplacement<T>& __restrict u) {
  LocalLandmark<T> p[kCount];
  for (std::size_t j = 0; j < kCount; ++j) p[j] = landmarks[chosen[j]];
  for (std::size_t i = first; i < first + kRun; ++i) {
    T ux = kFirst ? T(0) : u.ux[i], uy = kFirst ? T(0) : u.uy[i], uz = kFirst ? T(0) : u.uz[i];
#pragma GCC unroll 4
    for (std::size_t j = 0; j < kCount; ++j) {
      const T w = psi<K, T>(X.x[i] - p[j].x, X.y[i] - p[j].y, X.z[i] - p[j].z);
      ux += w * p[j].wx;
      uy += w * p[j].wy;
      uz += w * p[j].wz;
    }
    u.ux[i] = ux;
    u.uy[i] = uy;
    u.uz[i] = uz;
  }
}

// u for the kRun points from `first`. Sums are kept in memory between passes: 12 instructions of some 80 for four
// landmarks and one vector of points.
template <class K, class T, std::size_t kRun>
BRACHY_INLINE void direct(const BlockPoints<T>& X, std::size_t first, const LocalLandmark<T>* landmarks,
                          const std::uint32_t* chosen, std::size_t count, BlockDisplacement<T>& u) {
  std::size_t j = count % 4;
  if (j == 0) {
    add_landmarks<K, T, kRun, 4, true>(X, first, landmarks, chosen, u);
    j = 4;
  } else if (j == 1) {
    add_landmarks<K, T, kRun, 1, true>(X, first, landmarks, chosen, u);
  } else if (j == 2) {
    add_landmarks<K, T, kRun, 2, true>(X, first, landmarks, chosen, u);
  } else {
    add_landmarks<K, T, kRun, 3, true>(X, first, landmarks, chosen, u);
  }
  for (; j < count; j += 4) add_landmarks<K, T, kRun, 4, false>(X, first, landmarks, chosen + j, u);
}

// Squared distance of a landmark from a box.
BRACHY_INLINE float squared_distance(float x, float y, float z, const LocalBox& box) {
  const float dx = std::max(std::max(box.min[0] - x, x - box.max[0]), 0.0f);
  const float dy = std::max(std::max(box.min[1] - y, y - box.max[1]), 0.0f);
  const float dz = std::max(std::max(box.min[2] - z, z - box.max[2]), 0.0f);
  return dx * dx + dy * dy + dz * dz;
}

struct Choose {
  BRACHY_INLINE static std::size_t choose(const LandmarkPlanes& p, const LocalBox& box,
                                          std::uint32_t* chosen) {
    std::size_t count = 0;
    for (std::size_t first = 0; first < p.count; first += kGroupSize) {
      float d2[kGroupSize];
      for (std::size_t j = 0; j < kGroupSize; ++j)
        d2[j] = squared_distance(p.x[first + j], p.y[first + j], p.z[first + j], box);
      for (std::size_t j = 0; j < kGroupSize; ++j) {
        chosen[count] = static_cast<std::uint32_t>(first + j);
        count += d2[j] < 1.0f;
      }
    }
    return count;
  }
};

#if defined(__x86_64__)
// The same with a compression by mask, which no compiler makes of the loop above.
struct ChooseAvx512 {
  BRACHY_AVX512 static std::size_t choose(const LandmarkPlanes& p, const LocalBox& box,
                                          std::uint32_t* chosen) {
    const __m512 one = _mm512_set1_ps(1);
    __m512i index = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    std::size_t count = 0;
    for (std::size_t first = 0; first < p.count; first += kGroupSize) {
      alignas(64) float d2[kGroupSize];
      for (std::size_t j = 0; j < kGroupSize; ++j)
        d2[j] = squared_distance(p.x[first + j], p.y[first + j], p.z[first + j], box);
      const __mmask16 near = _mm512_cmp_ps_mask(_mm512_load_ps(d2), one, _CMP_LT_OQ);
      // Not a compressed store: what follows reads single indices, which cannot be forwarded from one.
      _mm512_storeu_si512(chosen + count, _mm512_maskz_compress_epi32(near, index));
      count += static_cast<std::size_t>(__builtin_popcount(near));
      index = _mm512_add_epi32(index, _mm512_set1_epi32(kGroupSize));
    }
    return count;
  }
};
#else
using ChooseAvx512 = Choose;
#endif

template <class K, class Choose, std::size_t kRun>
BRACHY_INLINE std::size_t direct_block(const BlockPoints<float>& X, const LocalBox* boxes,
                                       const LandmarkPlanes& planes, const LocalLandmark<float>* landmarks,
                                       std::uint32_t* chosen, BlockDisplacement<float>& u) {
  std::size_t pairs = 0;
  for (std::size_t first = 0; first < kPoints; first += kRun) {
    const std::size_t count = Choose::choose(planes, boxes[first / kRun], chosen);
    pairs += kRun * count;
    if (count > 0) {
      direct<K, float, kRun>(X, first, landmarks, chosen, count, u);
      continue;
    }
    for (std::size_t i = first; i < first + kRun; ++i) u.ux[i] = u.uy[i] = u.uz[i] = 0;
  }
  return pairs;
}

template <int kCount, bool kFirst>
BRACHY_INLINE void add_columns(const float* __restrict columns, const float* __restrict d,
                               BlockDisplacement<float>& __restrict u) {
  for (std::size_t i = 0; i < kPoints; ++i) {
    float ux = kFirst ? 0.0f : u.ux[i], uy = kFirst ? 0.0f : u.uy[i], uz = kFirst ? 0.0f : u.uz[i];
#pragma GCC unroll 4
    for (int k = 0; k < kCount; ++k) {
      const float b = columns[static_cast<std::size_t>(k) * kPoints + i];
      ux += b * d[3 * k];
      uy += b * d[3 * k + 1];
      uz += b * d[3 * k + 2];
    }
    u.ux[i] = ux;
    u.uy[i] = uy;
    u.uz[i] = uz;
  }
}

BRACHY_INLINE void condensed(const float* columns, const float* d, std::size_t m,
                             BlockDisplacement<float>& u) {
  std::size_t k = 0;
  if (m >= kTogether) {
    add_columns<kTogether, true>(columns, d, u);
    k = kTogether;
  } else {
    u = {};
  }
  for (; k + kTogether <= m; k += kTogether)
    add_columns<kTogether, false>(columns + k * kPoints, d + 3 * k, u);
  for (; k < m; ++k) add_columns<1, false>(columns + k * kPoints, d + 3 * k, u);
}

template <class K>
BRACHY_INLINE void condense(const BlockPoints<double>& X, double x, double y, double z, const double* shares,
                            std::size_t m, double* columns) {
  double w[kPoints];
  for (std::size_t i = 0; i < kPoints; ++i) w[i] = psi<K, double>(X.x[i] - x, X.y[i] - y, X.z[i] - z);
  for (std::size_t k = 0; k < m; ++k) {
    const double share = shares[k];
    double* column = columns + k * kPoints;
    for (std::size_t i = 0; i < kPoints; ++i) column[i] += w[i] * share;
  }
}

// One copy of the loops for a target.
// NOLINTBEGIN(bugprone-macro-parentheses): an attribute or a template cannot stand in parentheses.
#define BRACHY_TARGET(name, attribute, Choose)                                                        \
  template <class K>                                                                                  \
  struct name {                                                                                       \
    attribute static std::size_t choose(const LandmarkPlanes& p, const LocalBox& box,                 \
                                        std::uint32_t* chosen) {                                      \
      return Choose::choose(p, box, chosen);                                                          \
    }                                                                                                 \
    template <std::size_t kRun>                                                                       \
    attribute static std::size_t direct_float(const BlockPoints<float>& X, const LocalBox* boxes,     \
                                              const LandmarkPlanes& p, const LocalLandmark<float>* l, \
                                              std::uint32_t* chosen, BlockDisplacement<float>& u) {   \
      return direct_block<K, Choose, kRun>(X, boxes, p, l, chosen, u);                                \
    }                                                                                                 \
    attribute static void direct_double(const BlockPoints<double>& X, std::size_t first,              \
                                        const LocalLandmark<double>* l, const std::uint32_t* chosen,  \
                                        std::size_t count, BlockDisplacement<double>& u) {            \
      direct<K, double, kGroupSize>(X, first, l, chosen, count, u);                                   \
    }                                                                                                 \
    attribute static void apply(const float* columns, const float* d, std::size_t m,                  \
                                BlockDisplacement<float>& u) {                                        \
      condensed(columns, d, m, u);                                                                    \
    }                                                                                                 \
    attribute static void build(const BlockPoints<double>& X, double x, double y, double z,           \
                                const double* shares, std::size_t m, double* columns) {               \
      condense<K>(X, x, y, z, shares, m, columns);                                                    \
    }                                                                                                 \
    static constexpr BlockKernels kLoops{                                                             \
        choose, direct_float<kGroupSize>, direct_float<kPoints>, direct_double, apply, build};        \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(Generic, , Choose);
BRACHY_TARGET(Sse4, BRACHY_SSE4, Choose);
BRACHY_TARGET(Avx2, BRACHY_AVX2, Choose);
BRACHY_TARGET(Avx512, BRACHY_AVX512, ChooseAvx512);

}  // namespace

const BlockKernels& block_kernels(const Kernel& kernel, SimdTarget target) {
  return std::visit(
      [&]<class K>(K) -> const BlockKernels& {
        return loops_for(target, Generic<K>::kLoops, Sse4<K>::kLoops, Avx2<K>::kLoops, Avx512<K>::kLoops);
      },
      kernel);
}

}  // namespace brachy
