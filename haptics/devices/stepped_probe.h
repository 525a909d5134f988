#pragma once

#include <cstdint>

#include "core/realtime/hand_over.h"
#include "haptics/devices/device.h"
#include "haptics/devices/stepper.h"

namespace brachy {

/// The probe on the daemon's own stepper, used while no device moves it. Until it is first sent somewhere there is no
/// probe. It begins where it rests and moves at Stepper's speeds.
///
/// Threads: move_to, release and is_on belong to the io thread; the rest to the 200 Hz thread. They share a triple
/// buffer only. Real-time: update is wait-free.
class SteppedProbe final : public Device {
 public:
  explicit SteppedProbe(const RigidTransform& X_WR) : X_WR_(X_WR) {}

  void move_to(const StepperPlace& place) { send({true, place}); }
  /// Gives the probe up: a device takes it.
  void release() {
    if (sent_.is_on) send({});
  }
  bool is_on() const { return sent_.is_on; }

  /// Takes the newest command; whether the stepper has the probe in this tick.
  bool has_probe();
  /// Precondition: has_probe(). A probe that somebody left elsewhere is taken out in one tick and put in at its place
  /// of rest in the next.
  bool update(std::int64_t now_ns, NeedlePose& pose) override;

 private:
  struct Command {
    bool is_on = false;
    StepperPlace place;
  };
  void send(const Command& command) {
    sent_ = command;
    commands_.writer.slot() = command;
    commands_.writer.publish();
  }

  const RigidTransform X_WR_;
  HandOver<Command> commands_;
  Command sent_;  // io thread
  // 200 Hz thread
  bool was_on_ = false;
  Stepper stepper_;
  std::int64_t last_ns_ = 0;
  std::uint64_t sequence_ = 0;
};

}  // namespace brachy
