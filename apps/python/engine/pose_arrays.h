#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/needle/needle_pose.h"

namespace brachy {

/// The tolerance and range of poses over the wire (haptics/devices/pose_guard.h).
constexpr double kPoseRigidity = 1e-3, kFarthestTipMm = 1e4;

/// The pose that `numbers` say: X_WN row by row, 3×4 or 4×4, mm. All NaN: no needle. What cannot be a pose is said in
/// `error`, one sentence without an end.
NeedlePose pose_of(std::span<const double> numbers, std::string& error);

}  // namespace brachy
