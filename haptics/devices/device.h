#pragma once

#include <cstdint>

#include "core/needle/needle_pose.h"

namespace brachy {

/// A source of needle poses.
class Device {
 public:
  virtual ~Device() = default;

  /// Called once a tick with the monotonic clock. Writes the newest pose and returns true if there is one
  /// that no earlier call has given; else leaves `pose` alone, save its button, and returns false. The caller
  /// keeps its pose from tick to tick, so that the needle stays where it was last seen.
  ///
  /// Threads: the 200 Hz thread only.
  ///
  /// Real-time: no lock, no allocation, no exception, no waiting.
  virtual bool update(std::int64_t now_ns, NeedlePose& pose) = 0;
};

}  // namespace brachy
