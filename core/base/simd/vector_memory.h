#pragma once

#include <cstring>

#include "core/base/simd/simd_attributes.h"

namespace brachy {

/// A vector of doubles (vector_size) from and to memory of any alignment, for the inner loops.
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

}  // namespace brachy
