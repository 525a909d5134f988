#include "haptics/switched_device.h"

#include <cassert>
#include <utility>

namespace brachy {

SwitchedDevice::SwitchedDevice(const PoseGuardSettings& guard, std::optional<ScriptedDevice> script)
    : network_(guard), script_(std::move(script)) {}

void SwitchedDevice::play(bool loop) {
  assert(has_script());
  assert(is_told_to_play_ || !network_.attached());
  if (!is_told_to_play_) network_.attach();  // for its button
  is_told_to_play_ = true;
  command_writer_.slot() = {true, loop};
  command_writer_.publish();
}

void SwitchedDevice::stop() {
  if (!is_told_to_play_) return;
  is_told_to_play_ = false;
  network_.detach();
  command_writer_.slot() = {};
  command_writer_.publish();
}

bool SwitchedDevice::update(std::int64_t now_ns, NeedlePose& pose) {
  if (command_reader_.update()) {
    const Command& command = command_reader_.value();
    if (command.plays) script_->restart(command.loops);
    pose.present = pose.button = script_button_ = false;
  }
  return command_reader_.value().plays ? update_script(now_ns, pose) : network_.update(now_ns, pose);
}

bool SwitchedDevice::update_script(std::int64_t now_ns, NeedlePose& pose) {
  pose.button = script_button_;  // a script that has nothing new leaves it as it was
  const bool is_fresh = script_->update(now_ns, pose);
  script_button_ = pose.button;
  pressed_.present = pose.present;
  network_.update(now_ns, pressed_);
  pose.button |= pressed_.button;
  return is_fresh;
}

}  // namespace brachy
