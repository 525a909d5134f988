#pragma once

#include "core/base/simd/simd_target.h"

// For the inner loops, which are plain C++: a function with one of these attributes is a copy of the loops it calls,
// vectorised for its target (SimdTarget); the loops are BRACHY_INLINE.
#if defined(__x86_64__)
#define BRACHY_SSE4 __attribute__((target("sse4.2"), flatten))
#define BRACHY_AVX2 __attribute__((target("avx2,fma"), flatten))
#if defined(__clang__)  // clang chooses the vector width itself
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

/// The copy of a table of loops that belongs to `target`.
template <class Loops>
const Loops& loops_for(SimdTarget target, const Loops& generic, const Loops& sse4, const Loops& avx2,
                       const Loops& avx512) {
  switch (target) {
    case SimdTarget::kSse4:
      return sse4;
    case SimdTarget::kAvx2:
      return avx2;
    case SimdTarget::kAvx512:
      return avx512;
    case SimdTarget::kGeneric:
      break;
  }
  return generic;
}

}  // namespace brachy
