#pragma once

#include <cstdint>

#include "core/base/simd/simd_attributes.h"

namespace brachy {

/// 32 bits that look random, of 32 bits (C. Wellons, Prospecting for hash functions, 2018: "lowbias32").
BRACHY_INLINE std::uint32_t hashed(std::uint32_t v) {
  v ^= v >> 16;
  v *= 0x7feb352dU;
  v ^= v >> 15;
  v *= 0x846ca68bU;
  v ^= v >> 16;
  return v;
}

/// The same in half the time: values of nodes of the grid below within four steps correlate by up to 0.03.
BRACHY_INLINE std::uint32_t hashed_quickly(std::uint32_t v) {
  v ^= v >> 15;
  v *= 0x2c1b3c6dU;
  v ^= v >> 17;
  return v;
}

/// A node's key on an infinite grid: the coordinates' keys are added.
constexpr std::uint32_t kNodeX = 0x9e3779b1U, kNodeY = 0x85ebca77U, kNodeZ = 0xc2b2ae3dU;

}  // namespace brachy
