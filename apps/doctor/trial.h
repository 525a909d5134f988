#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/scene/scene.h"

namespace brachy {

/// Measurement of a scene in a daemon of its own. Times in ms.
struct TrialResult {
  std::uint64_t ticks = 0, missed = 0;
  std::uint64_t control_ticks = 0, control_missed = 0;  ///< of an idle thread on the same deadlines
  double tick_p50_ms = 0, tick_p99_ms = 0, tick_max_ms = 0;
  double lateness_p99_ms = 0;
  std::uint64_t late = 0;  ///< ticks that show some tissue where an earlier one put it (kStepLate)
  double max_lag_mm = 0;   ///< the largest TickSummary::lag_mm
};

/// Runs the scene for `seconds` as brachyd would, in a process of its own, on a free port of the loopback,
/// with the needles that `trajectory` (CSV) moves. Throws UserError if the daemon refuses the scene,
/// std::runtime_error if it does not end by itself. Precondition: this process has one thread.
TrialResult try_scene(const Scene& scene, const std::filesystem::path& trajectory, double seconds);

/// A trajectory for the scene's needles: through the capsule, to four fifths of the tissue's depth, a push to
/// the side, and out, in `seconds`; as a CSV's text. The needles go in along +z, side by side. Reads the
/// scene's surface; throws UserError.
std::string representative_insertion(const Scene& scene, double seconds);

}  // namespace brachy
