#pragma once

// For the inner loops, which are plain C++: a function with one of these attributes is a copy of the loops it calls,
// vectorised for its target (SimdTarget); the loops are BRACHY_INLINE.
#if defined(__x86_64__)
#define BRACHY_SSE4 __attribute__((target("sse4.2"), flatten))
#define BRACHY_AVX2 __attribute__((target("avx2,fma"), flatten))
#if defined(__clang__)  // chooses the width itself
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
