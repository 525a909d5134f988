#include "core/brachytherapy/dose/swelling_phases.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace brachy {

std::array<SwellingPhase, kSwellingPhases> resolving_swelling(double half_life_days,
                                                              const Vec3& day_zero_stretch,
                                                              double resolved_days) {
  assert(half_life_days > 0 && resolved_days > 0);
  const double rate = std::numbers::ln2 / half_life_days;
  constexpr std::size_t kSwollen = kSwellingPhases - 1;
  const double length = resolved_days / kSwollen;
  std::array<SwellingPhase, kSwellingPhases> phases;
  for (std::size_t k = 0; k < kSwollen; ++k) {
    const double begin = static_cast<double>(k) * length, end = begin + length;
    const double share = std::exp(-rate * begin) - std::exp(-rate * end);
    // Mean time of the decays within the phase: of t λ e^(−λt).
    const double mean = 1 / rate + (begin * std::exp(-rate * begin) - end * std::exp(-rate * end)) / share;
    phases[k] = {Vec3::Ones() + (1 - mean / resolved_days) * (day_zero_stretch - Vec3::Ones()), share};
  }
  phases[kSwollen].share = std::exp(-rate * resolved_days);
  return phases;
}

}  // namespace brachy
