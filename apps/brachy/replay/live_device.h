#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "apps/brachy/replay/simulated_device.h"
#include "haptics/force/received_force.h"
#include "haptics/simulated/delay_line.h"
#include "net/wire/messages.h"

namespace brachy {

/// The device with mass of a live replay: as in SimulatedLoop, but the simulation is a daemon and time is real. Cycles
/// are on a fixed time grid; those that are overdue are run one after the other, so that a late wake-up delays a pose
/// and does not change the motion.
/// Threads: one.
class LiveDevice {
 public:
  struct Pose {
    RigidTransform X_WN;
    std::int64_t stamp_ns = 0;
  };
  using Hand = std::function<RigidTransform(double t_s)>;  ///< since the start

  /// The hand is at `hand`(0) at `start_ns`, the device at rest in it.
  LiveDevice(const SimulatedDeviceOptions& options, Hand hand, std::int64_t start_ns);

  /// A model or a force from the daemon.
  void take(const LocalContactModel& model, std::int64_t pose_stamp_ns, std::int64_t now_ns) {
    models_.push({model, pose_stamp_ns}, now_ns);
  }
  void take(const net::ForceMessage& force, std::int64_t now_ns) { forces_.push(force, now_ns); }

  /// Runs the cycles up to now and gives the newest pose that has passed the added delay.
  std::optional<Pose> advance(std::int64_t now_ns);

  const HandReport& report() const { return report_; }

 private:
  struct StampedModel {
    LocalContactModel model;
    std::int64_t pose_stamp_ns;
  };

  void cycle(std::int64_t at_ns);
  Vec3 force_now(const Vec3& tip, std::int64_t at_ns);

  LoopSettings settings_;
  Hand hand_;
  std::int64_t start_ns_, next_ns_;
  std::uint64_t cycles_ = 0;
  DeviceDynamics device_;
  LocalForce local_;
  ReceivedForce received_;
  DelayLine<Pose> poses_;
  DelayLine<StampedModel> models_;
  DelayLine<net::ForceMessage> forces_;
  HandReport report_;
};

}  // namespace brachy
