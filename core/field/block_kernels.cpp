// Compiled with -ffp-contract=fast: where a target has FMA, a·b + c is one instruction.
#include "core/field/block_kernels.h"

#include <cmath>

// The loops below are plain; each function with one of these attributes is a copy of them, vectorised for its target.
#if defined(__clang__)
#define BRACHY_WIDE ""  // clang chooses the width itself
#else
#define BRACHY_WIDE ",prefer-vector-width=512"
#endif
#if defined(__x86_64__)
#define BRACHY_SSE4 __attribute__((target("sse4.2"), flatten))
#define BRACHY_AVX2 __attribute__((target("avx2,fma"), flatten))
#define BRACHY_AVX512 __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,fma" BRACHY_WIDE), flatten))
#else
#define BRACHY_SSE4
#define BRACHY_AVX2
#define BRACHY_AVX512
#endif
#define BRACHY_INLINE inline __attribute__((always_inline))

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;
constexpr int kTogether = 4;  // landmarks for each pass over the points: their sums stay in registers

template <class K, class T>
BRACHY_INLINE T psi(T dx, T dy, T dz) {
  const T r = std::sqrt(dx * dx + dy * dy + dz * dz);
  return K::inside(r < T(1) ? r : T(1));
}

template <class K, class T, int kCount>
BRACHY_INLINE void add_landmarks(const BlockPoints<T>& __restrict X,
                                 const BlockLandmark<T>* __restrict landmarks,
                                 BlockDisplacement<T>& __restrict u) {
  for (std::size_t i = 0; i < kPoints; ++i) {
    T ux = u.ux[i], uy = u.uy[i], uz = u.uz[i];
#pragma GCC unroll 4
    for (int j = 0; j < kCount; ++j) {
      const BlockLandmark<T>& p = landmarks[j];
      const T w = psi<K, T>(X.x[i] - p.x, X.y[i] - p.y, X.z[i] - p.z);
      ux += w * p.wx;
      uy += w * p.wy;
      uz += w * p.wz;
    }
    u.ux[i] = ux;
    u.uy[i] = uy;
    u.uz[i] = uz;
  }
}

template <class K, class T>
BRACHY_INLINE void direct(const BlockPoints<T>& X, const BlockLandmark<T>* landmarks, std::size_t n,
                          BlockDisplacement<T>& u) {
  u = {};
  std::size_t j = 0;
  for (; j + kTogether <= n; j += kTogether) add_landmarks<K, T, kTogether>(X, landmarks + j, u);
  for (; j < n; ++j) add_landmarks<K, T, 1>(X, landmarks + j, u);
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

// One copy of the four loops for a target.
#define BRACHY_TARGET(name, attribute)                                                                \
  template <class K>                                                                                  \
  struct name {                                                                                       \
    attribute static void direct_float(const BlockPoints<float>& X, const BlockLandmark<float>* l,    \
                                       std::size_t n, BlockDisplacement<float>& u) {                  \
      direct<K, float>(X, l, n, u);                                                                   \
    }                                                                                                 \
    attribute static void direct_double(const BlockPoints<double>& X, const BlockLandmark<double>* l, \
                                        std::size_t n, BlockDisplacement<double>& u) {                \
      direct<K, double>(X, l, n, u);                                                                  \
    }                                                                                                 \
    attribute static void apply(const float* columns, const float* d, std::size_t m,                  \
                                BlockDisplacement<float>& u) {                                        \
      condensed(columns, d, m, u);                                                                    \
    }                                                                                                 \
    attribute static void build(const BlockPoints<double>& X, double x, double y, double z,           \
                                const double* shares, std::size_t m, double* columns) {               \
      condense<K>(X, x, y, z, shares, m, columns);                                                    \
    }                                                                                                 \
    static constexpr BlockKernels kLoops{direct_float, direct_double, apply, build};                  \
  }

BRACHY_TARGET(Generic, );
BRACHY_TARGET(Sse4, BRACHY_SSE4);
BRACHY_TARGET(Avx2, BRACHY_AVX2);
BRACHY_TARGET(Avx512, BRACHY_AVX512);

}  // namespace

const BlockKernels& block_kernels(const Kernel& kernel, SimdTarget target) {
  return std::visit(
      [&]<class K>(K) -> const BlockKernels& {
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
