#pragma once

#include <array>

#include "core/base/rigid_transform.h"

namespace brachy {

/// A part of a source's decay in which the gland is swollen by `stretch` along x, y and z.
struct SwellingPhase {
  Vec3 stretch = Vec3::Ones();
  double share = 0;  ///< of the source's whole decay
};

/// The decay of a source in a gland that is swollen by `day_zero_stretch` at the implant, and whose swelling goes down
/// linearly to nothing after `resolved_days`: in that time phases of equal length, each at its mean stretch, and the
/// rest. The shares add up to 1.
/// Source: the integral over the shrinking gland is that of Waterman et al., Int. J. Radiat. Oncol. Biol. Phys. 41
/// (1998), 1069–1077, with a linear law for its exponential one.
inline constexpr std::size_t kSwellingPhases = 11;
std::array<SwellingPhase, kSwellingPhases> resolving_swelling(double half_life_days,
                                                              const Vec3& day_zero_stretch,
                                                              double resolved_days);

}  // namespace brachy
