#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// The needles' motion in a recording: the poses that poses.csv of its export has, bit for bit.
struct RecordedMotion {
  NeedleTrajectories trajectories;
  std::vector<std::string> remarks;  ///< why a replay may not be what was recorded, a sentence each
};

/// What a replay is to do with the model: a daemon has its own, offline it must not have changed.
enum class ReplayedModel { kDaemons, kRecorded };

/// Reads the motion of a recording for a scene of `needle_count` needles. Throws UserError where it cannot be read, has no
/// poses or more than kMaxTrajectorySamples, or where a trajectory cannot say what happened: the simulation was reset, took
/// another model (kRecorded), or a needle went and others went on.
RecordedMotion load_recorded_motion(const std::filesystem::path& file, ReplayedModel model,
                                    std::size_t needle_count = kMaxTrajectoryNeedles);

}  // namespace brachy
