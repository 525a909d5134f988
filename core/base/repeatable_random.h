#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace brachy {

/// SplitMix64's mixing: numbers that are close give bits that have nothing to do with each other (G. Steele, D. Lea, C.
/// Flood, Fast splittable pseudorandom number generators, OOPSLA 2014).
constexpr std::uint64_t mixed(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

/// Random numbers that are the same everywhere; std's distributions are not.
class RepeatableRandom {
 public:
  explicit RepeatableRandom(std::uint64_t seed) : engine_(seed) {}
  double share() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }  ///< [0, 1)
  int below(int count) { return static_cast<int>(share() * count); }         ///< 0 … count − 1
  int between(int least, int most) { return least + below(most - least + 1); }
  /// Mean 0, SD 1 (G. Box, M. Muller, Ann. Math. Stat. 29 (1958) 610).
  double normal() {
    const double u = 1 - share(), v = share();
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace brachy
