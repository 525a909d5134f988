#pragma once

#include <cstdint>
#include <optional>

#include "core/realtime/triple_buffer.h"
#include "haptics/device.h"
#include "haptics/network_device.h"
#include "haptics/scripted_device.h"

namespace brachy {

/// A needle whose poses come from the network, or, while it plays, from a script.
///
/// Threads: play, stop and what network() offers belong to the io thread; update to the 200 Hz thread. They meet in triple
/// buffers only.
///
/// Real-time: update is wait-free.
class SwitchedDevice final : public Device {
 public:
  /// `script`: nothing where there is none for this needle.
  SwitchedDevice(const PoseGuardSettings& guard, std::optional<ScriptedDevice> script);

  bool has_script() const { return script_.has_value(); }

  /// From the next tick on the script plays from its beginning; the button pressed by network().press counts beside its
  /// own. Precondition: has_script(), and the network's device is not attached.
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
  TripleBuffer<Command> commands_;
  TripleBuffer<Command>::Writer command_writer_ = commands_.writer();  // io thread
  bool is_told_to_play_ = false;                                       // io thread
  TripleBuffer<Command>::Reader command_reader_ = commands_.reader();  // 200 Hz thread
  bool script_button_ = false;                                         // 200 Hz thread, as the next
  NeedlePose pressed_;  // what the network says while the script plays
};

}  // namespace brachy
