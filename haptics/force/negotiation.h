#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptics/force/force_limiter.h"

namespace brachy {

/// Damping of a device that does not state its own, N·s/mm: half a newton second per metre.
inline constexpr double kDefaultDampingNsPerMm = 0.0005;

/// What a device states above these is not plausible and has its default instead: no handle takes such a force. The
/// damping's bound, 50 N·s/m, also catches most values that were meant in N·s/m: those of devices are 0.1 to 10.
inline constexpr double kLargestForceN = 50, kLargestStiffnessNPerMm = 1000, kLargestDampingNsPerMm = 0.05;

/// Limits as a device states them; NaN if it does not.
struct StatedLimits {
  double max_force_n = std::numeric_limits<double>::quiet_NaN();
  double max_stiffness_n_per_mm = std::numeric_limits<double>::quiet_NaN();
  double damping_n_s_per_mm = std::numeric_limits<double>::quiet_NaN();
};

/// The loop that is closed from a pose to the force that it causes.
struct ClosedLoop {
  /// T: how long each force is held. A local model: the device's own; else the wire's
  double period_s = 0.001;
  /// τ: from the pose's sampling to the begin of its force. A local model: 0; else the whole round trip, with
  /// what the pose waits for its evaluation and the force for the device's next cycle.
  double delay_s = 0;
};

/// The stiffest virtual spring, N/mm, that a device of damping b (N·s/mm) renders passively through a loop
/// that holds each force for T and applies it τ late: 2b/(T + 2τ), core/DESIGN.md, section 4. Without delay b
/// > KT/2, Colgate and Schenkel, Passivity of a class of sampled-data systems, J. Robotic Systems 14 (1997)
/// 37–47, for a spring without damping of its own; the held sample is on average T/2 old, and τ adds to that.
inline double passive_stiffness_n_per_mm(double damping_n_s_per_mm, const ClosedLoop& loop) {
  return 2 * damping_n_s_per_mm / (loop.period_s + 2 * loop.delay_s);
}

/// Upper bound of the delay τ of a loop over the wire whose forces are evaluated every `period_s`: a pose
/// waits up to one period for its evaluation, its force up to one for the device's next cycle, and both are
/// transmitted. A server that answers each pose on arrival saves the first period, a device that applies each
/// force on arrival the second.
inline double wire_delay_s(double round_trip_s, double period_s) {
  return round_trip_s + 2 * period_s;
}

/// Whether a number is stated and plausible: above 0 and at most `largest`.
inline bool is_plausible(double value, double largest) {
  return value > 0 && value <= largest;  // not NaN
}
/// Whether a number is stated, but not plausible.
inline bool is_implausible(double value, double largest) {
  return !std::isnan(value) && !is_plausible(value, largest);
}

/// Damping to calculate with, N·s/mm.
inline double damping_of(const StatedLimits& stated) {
  return is_plausible(stated.damping_n_s_per_mm, kLargestDampingNsPerMm) ? stated.damping_n_s_per_mm
                                                                         : kDefaultDampingNsPerMm;
}

/// Limits of the device in that loop: its stated limits, defaults for those it does not state or that are not
/// plausible, and a stiffness that is never above the passive one.
inline ForceLimits negotiate(const StatedLimits& stated, const ClosedLoop& loop) {
  ForceLimits limits;
  if (is_plausible(stated.max_force_n, kLargestForceN)) limits.max_force_n = stated.max_force_n;
  limits.max_stiffness_n_per_mm = passive_stiffness_n_per_mm(damping_of(stated), loop);
  if (is_plausible(stated.max_stiffness_n_per_mm, kLargestStiffnessNPerMm))
    limits.max_stiffness_n_per_mm = std::min(limits.max_stiffness_n_per_mm, stated.max_stiffness_n_per_mm);
  return limits;
}

}  // namespace brachy
