#pragma once

#include <cstdint>

#include "core/base/rigid_transform.h"
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

/// Smooth noise, −1 … 1, with grains of about `cell` (mm along x, y, z): a value of each grid node, interpolated.
inline double value_noise(const Vec3& X, const Vec3& cell, std::uint32_t seed) {
  std::int32_t first[3];
  double t[3];
  for (int k = 0; k < 3; ++k) {
    const double x = X[k] / cell[k];
    const double floor = __builtin_floor(x);
    first[k] = static_cast<std::int32_t>(floor);
    const double s = x - floor;
    t[k] = s * s * (3 - 2 * s);
  }
  double sum = 0;
  for (std::uint32_t c = 0; c < 8; ++c) {
    const std::uint32_t dx = c & 1U, dy = c >> 1 & 1U, dz = c >> 2;
    const std::uint32_t key = (static_cast<std::uint32_t>(first[0]) + dx) * kNodeX +
                              (static_cast<std::uint32_t>(first[1]) + dy) * kNodeY +
                              (static_cast<std::uint32_t>(first[2]) + dz) * kNodeZ + seed;
    const double value = static_cast<double>(hashed(key)) * (2.0 / 4294967296.0) - 1;
    sum += value * (dx ? t[0] : 1 - t[0]) * (dy ? t[1] : 1 - t[1]) * (dz ? t[2] : 1 - t[2]);
  }
  return sum;
}

}  // namespace brachy
