#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// The needles' motion in a recording: bit for bit the poses in poses.csv of its export.
struct RecordedMotion {
  NeedleTrajectories trajectories;
  /// reasons why a replay may differ from what was recorded, a sentence each
  std::vector<std::string> remarks;
};

/// Model of a replay: a daemon has its own; offline it must not have changed during the recording.
enum class ReplayedModel { kDaemons, kRecorded };

/// Reads the motion of a recording for a scene of `needle_count` needles. Throws UserError where it cannot be read,
/// has no poses or more than kMaxTrajectorySamples, or where a trajectory cannot represent it: the simulation was
/// reset, changed its model (kRecorded), or one needle was removed while others stayed.
RecordedMotion load_recorded_motion(const std::filesystem::path& file, ReplayedModel model,
                                    std::size_t needle_count = kMaxTrajectoryNeedles);

}  // namespace brachy
