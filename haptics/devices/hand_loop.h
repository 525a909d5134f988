#pragma once

#include <cstdint>
#include <optional>

#include "haptics/devices/hand_device.h"
#include "haptics/force/local_force.h"

namespace brachy {

/// How the hand's movements move the needle.
struct HandMapping {
  Mat3 R_WD = Mat3::Identity();  ///< of the device's frame in the world: device_in_world()
  Vec3 start_tip_mm =
      Vec3(0, 0, -60);  ///< where the first reading puts the tip, W: in front of the default phantom
  double scale = 1;     ///< millimetres of the needle for one of the hand, > 0
};

/// The cycle beside a device: force out, position in, the force of the newest LOCAL_MODEL evaluated at it. It reads no
/// clock and knows no socket.
///
/// Without a model for kLongestSilenceNs the force goes to 0, at 0.5 N/ms: of up to 9 N it is 0 within 50 ms of the
/// last model, whatever the daemon or the network does. disconnect() does so at once, and so does a hand whose place is
/// not known; one that was away for longer than kLongestAbsenceNs takes the needle up again where it is.
/// Threads: one. Real-time: as the device; nothing here allocates, locks or throws.
class HandLoop {
 public:
  /// Models come with each tick, every 5 ms.
  static constexpr std::int64_t kLongestSilenceNs = 30'000'000;

  static constexpr std::int64_t kLongestAbsenceNs = 500'000'000;

  HandLoop(HandDevice& device, const HandMapping& mapping);

  struct Cycle {
    std::optional<RigidTransform> X_WN;  ///< to be sent as a pose; none: not known
    std::optional<bool> button;          ///< it went down or up
    Vec3 force_n = Vec3::Zero();         ///< on the needle, W: rendered by the next cycle
  };
  /// nullopt: the device is gone for good.
  std::optional<Cycle> run(std::int64_t now_ns);
  /// A LOCAL_MODEL arrived, for the pose of this stamp.
  void take(const LocalContactModel& model, std::int64_t pose_stamp_ns, std::int64_t now_ns);
  /// The daemon is gone: what was rendered goes to 0, and nothing is until the next model.
  void disconnect() { is_connected_ = false; }
  bool renders_force() const { return force_n_ != Vec3::Zero(); }

 private:
  std::optional<RigidTransform> place(const HandReading& reading, std::int64_t now_ns);

  HandDevice& device_;
  HandMapping mapping_;
  LocalForce local_;
  std::optional<Vec3> first_mm_;  // of the hand, D; none: it comes, or comes back
  Vec3 first_tip_mm_;             // where the needle's tip is then, W
  Vec3 tip_mm_;                   // last, W
  std::int64_t seen_ns_ = 0;      // when its place was last known
  Vec3 force_n_ = Vec3::Zero();   // W
  bool is_connected_ = false, button_ = false;
};

}  // namespace brachy
