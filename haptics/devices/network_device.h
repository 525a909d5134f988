#pragma once

#include <cstdint>

#include "core/needle/needle_pose.h"
#include "core/realtime/hand_over.h"
#include "haptics/devices/device.h"
#include "haptics/devices/pose_guard.h"

namespace brachy {

/// The needle of the client that holds the device lease: receives poses as they arrive and passes the newest
/// accepted one to the simulation. Between leases the needle stays at its last accepted pose until a new
/// device sends one.
///
/// Threads: attach, detach, submit, press, attached and guard belong to the io thread; update to the 200 Hz
/// thread. They share triple buffers only. Constructed before both threads start, destroyed after both end.
///
/// Real-time: update is wait-free.
class NetworkDevice final : public Device {
 public:
  explicit NetworkDevice(const PoseGuardSettings& settings = {}) : guard_(settings) {}

  /// A device got the lease: judge its poses without regard to its predecessor's clock and count.
  void attach();
  /// The lease ended. A pose accepted before and not yet used still counts; the button is up.
  void detach();
  bool attached() const { return attached_; }

  /// Judges a pose whose X_WN, sequence, stamp_ns and received_ns are set; an accepted one is marked present
  /// and replaces any that the simulation has not used yet. The status is reported to the sender.
  PoseStatus submit(NeedlePose pose);

  /// The button went down or up. Each press and release is seen by one tick at least, however quickly they
  /// follow.
  void press(bool pressed);

  /// An operator loads the needle as the plan's needle of that index, −1: as nothing. Whoever moves it.
  void load(std::int32_t plan_needle);

  const PoseGuard& guard() const { return guard_; }  ///< for its counters and faults

  bool update(std::int64_t now_ns, NeedlePose& pose) override;

 private:
  HandOver<NeedlePose> poses_;
  struct Load {
    std::uint32_t number = 0;
    std::int32_t plan_needle = -1;
  };
  HandOver<Load> loads_;
  HandOver<std::uint64_t> changes_;  // of the button since start; odd: it is down

  // io thread
  PoseGuard guard_;
  bool attached_ = false;
  std::uint64_t changes_sent_ = 0;
  Load last_load_;

  // 200 Hz thread
  alignas(64) std::uint64_t changes_seen_ = 0;
};

}  // namespace brachy
