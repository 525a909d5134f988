#pragma once

#include <cstdint>
#include <limits>

#include "haptics/devices/device.h"
#include "haptics/trajectory/trajectory.h"

namespace brachy {

/// Plays a trajectory: the first sample at the first update, from then on in real time. At the end it holds
/// the last pose, or, looping, jumps back to the first sample (the simulation takes the needle out and puts
/// it in again).
///
/// Poses carry a sequence from 1, the tick's time as stamp and arrival, and the button with every press since
/// the last tick (looping: in this lap).
///
/// Threads: constructed anywhere, then the 200 Hz thread only.
/// Real-time: update is wait-free.
class ScriptedDevice final : public Device {
 public:
  explicit ScriptedDevice(Trajectory trajectory, bool loop = false);
  /// One of several needles (NeedleTrajectories) whose devices are updated together: its clock runs from
  /// start_s, at or before the trajectory's start, to end_s, at or after its end. Before its first sample
  /// there is no needle.
  ScriptedDevice(Trajectory trajectory, bool loop, double start_s, double end_s);

  /// True at every tick up to and including the first one at or past the end (looping: always), but not where
  /// there is no needle; a looping needle that disappears for a while is reported once, by a pose that is not
  /// present.
  bool update(std::int64_t now_ns, NeedlePose& pose) override;

  /// Plays again from the first sample at the next update.
  void restart(bool loop);

  /// Whether the last pose has been returned; never when looping.
  bool finished() const { return finished_; }

 private:
  Trajectory trajectory_;
  bool loop_;
  double start_s_;
  std::int64_t duration_ns_;
  bool started_ = false;
  bool finished_ = false;
  std::int64_t start_ns_ = 0;
  std::uint64_t sequence_ = 0;
  static constexpr double kBeforeAll = -std::numeric_limits<double>::infinity();
  double last_s_ = kBeforeAll;  // the trajectory's time at the last update
};

}  // namespace brachy
