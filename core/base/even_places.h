#pragma once

#include <array>
#include <cstdint>

#include "core/base/repeatable_random.h"
#include "core/base/rigid_transform.h"

namespace brachy {

/// Places in the unit cube, one after the other, that fill it evenly: the R3 sequence of the generalised golden ratio
/// (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018), shifted by the seed (Cranley,
/// Patterson 1976). It runs in 64-bit integers, so that the places are the same on every machine.
class EvenPlaces {
 public:
  explicit EvenPlaces(std::uint64_t seed) {
    for (std::uint64_t& p : place_) {
      p = mixed(seed);
      seed += 0x9e3779b97f4a7c15ull;
    }
  }
  Vec3 next() {
    Vec3 p;
    for (std::size_t k = 0; k < 3; ++k) {
      place_[k] += kStep[k];  // modulo 1, exactly
      p[static_cast<Eigen::Index>(k)] = static_cast<double>(place_[k] >> 11) * 0x1p-53;
    }
    return p;
  }

 private:
  /// 2⁶⁴ g⁻¹, 2⁶⁴ g⁻², 2⁶⁴ g⁻³ with g = 1.22074408460575947536…, the root of g⁴ = g + 1.
  static constexpr std::array<std::uint64_t, 3> kStep = {0xD1B54A32D192ED03u, 0xABC98388FB8FAC02u,
                                                         0x8CB92BA72F3D8DD7u};
  std::array<std::uint64_t, 3> place_;
};

}  // namespace brachy
