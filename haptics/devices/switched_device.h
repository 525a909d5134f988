#pragma once

#include <cstdint>
#include <optional>

#include "core/realtime/hand_over.h"
#include "haptics/devices/device.h"
#include "haptics/devices/network_device.h"
#include "haptics/devices/scripted_device.h"
#include "haptics/devices/stepped_probe.h"

namespace brachy {

/// A needle whose poses come from the network, or, while it plays, from a script; the probe's may come from its
/// stepper.
///
/// Threads: play, stop and what network() offers belong to the io thread; update to the 200 Hz thread. They
/// share triple buffers only.
///
/// Real-time: update is wait-free.
class SwitchedDevice final : public Device {
 public:
  /// `script`: nullopt if this needle has none.
  SwitchedDevice(const PoseGuardSettings& guard, std::optional<ScriptedDevice> script);

  /// Gives the probe a stepper, which rests at X_WR. Before the threads start.
  void add_stepper(const RigidTransform& X_WR) { stepper_.emplace(X_WR); }
  /// Null: it has none. Of it the io thread uses move_to, release and is_on; a script that plays has precedence.
  SteppedProbe* stepper() { return stepper_ ? &*stepper_ : nullptr; }

  bool has_script() const { return script_.has_value(); }

  /// From the next tick on the script plays from its beginning; the button pressed by network().press counts
  /// beside its own. Precondition: has_script(), and the network's device is not attached.
  void play(bool loop);
  /// From the next tick on there is no needle until the network brings a pose. Does nothing while none plays.
  void stop();

  NetworkDevice& network() { return network_; }
  const NetworkDevice& network() const { return network_; }

  bool update(std::int64_t now_ns, NeedlePose& pose) override;

 private:
  struct Command {
    bool plays = false, loops = false;
  };
  bool update_script(std::int64_t now_ns, NeedlePose& pose);

  NetworkDevice network_;
  std::optional<ScriptedDevice> script_;
  std::optional<SteppedProbe> stepper_;
  HandOver<Command> commands_;
  bool is_playing_ = false;     // io thread
  bool script_button_ = false;  // 200 Hz thread, as the next
  NeedlePose pressed_;          // the network's button while the script plays
};

}  // namespace brachy
