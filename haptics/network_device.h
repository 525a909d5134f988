#pragma once

#include <cstdint>

#include "core/realtime/triple_buffer.h"
#include "core/sim/needle_pose.h"
#include "haptics/device.h"
#include "haptics/pose_guard.h"

namespace brachy {

/// The needle of whoever holds the device lease: takes poses as they arrive and hands the newest good one to
/// the simulation. Between leases the needle stays at its last good pose until a new device sends one.
///
/// Threads: attach, detach, submit, press, attached and guard belong to the io thread; update to the 200 Hz thread.
/// They meet in triple buffers only. Constructed before both, destroyed after both.
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
  /// and replaces any that the simulation has not used yet. The verdict goes back to the sender.
  PoseVerdict submit(NeedlePose pose);

  /// The button went down or up. Each press and release is seen by one tick at least, however quickly they follow.
  void press(bool pressed);

  const PoseGuard& guard() const { return guard_; }  ///< for its counters

  bool update(std::int64_t now_ns, NeedlePose& pose) override;

 private:
  TripleBuffer<NeedlePose> poses_;
  TripleBuffer<std::uint64_t> changes_;  // of the button since start; odd: it is down

  // io thread
  TripleBuffer<NeedlePose>::Writer writer_ = poses_.writer();
  PoseGuard guard_;
  bool attached_ = false;
  TripleBuffer<std::uint64_t>::Writer change_writer_ = changes_.writer();
  std::uint64_t changes_told_ = 0;

  // 200 Hz thread
  alignas(64) TripleBuffer<NeedlePose>::Reader reader_ = poses_.reader();
  TripleBuffer<std::uint64_t>::Reader change_reader_ = changes_.reader();
  std::uint64_t changes_seen_ = 0;
};

}  // namespace brachy
