#pragma once

#include <bit>
#include <cstdint>

namespace brachy {

/// ln x for positive normal x, without branches or calls, so that a loop over it vectorises (std::log keeps it
/// scalar). At x = 0 some finite number. Argument reduced to m in [√½, √2) by the exponent bits; then
/// float: ln(1+f) = f − f²/2 + f³P(f), least squares of degree 5, within 1e-7 + 1 ulp;
/// double: 2 artanh(f/(2+f)) by its series to s²¹, within 2 ulp.
inline float vector_log(float x) {
  constexpr std::int32_t kSqrtHalf = 0x3f3504f3;
  const auto bits = std::bit_cast<std::int32_t>(x);
  const std::int32_t exponent = (bits - kSqrtHalf) >> 23;
  const float f = std::bit_cast<float>(bits - exponent * (1 << 23)) - 1.0f;
  float p = -0.104698894f;
  p = p * f + 0.161729482f;
  p = p * f - 0.171088996f;
  p = p * f + 0.199045798f;
  p = p * f - 0.249837679f;
  p = p * f + 0.333348778f;
  return static_cast<float>(exponent) * 0.693147181f + (f - f * f * (0.5f - f * p));
}

inline double vector_log(double x) {
  constexpr std::int64_t kSqrtHalf = 0x3fe6a09e667f3bcd;
  const auto bits = std::bit_cast<std::int64_t>(x);
  const std::int64_t exponent = (bits - kSqrtHalf) >> 52;
  const double f = std::bit_cast<double>(bits - exponent * (std::int64_t{1} << 52)) - 1.0;
  const double s = f / (2.0 + f), z = s * s;
  double series = 1.0 / 21;
  for (int k = 19; k >= 1; k -= 2) series = series * z + 1.0 / k;
  return static_cast<double>(exponent) * 0.693147180559945309 + 2.0 * s * series;
}

}  // namespace brachy
