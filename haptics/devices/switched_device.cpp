#include "haptics/devices/switched_device.h"

#include <cassert>
#include <utility>

namespace brachy {

SwitchedDevice::SwitchedDevice(const PoseGuardSettings& guard, std::optional<ScriptedDevice> script)
    : network_(guard), script_(std::move(script)) {}

void SwitchedDevice::play(bool loop) {
  assert(has_script());
  assert(is_playing_ || !network_.attached());
  if (!is_playing_) network_.attach();  // for its button
  is_playing_ = true;
  commands_.writer.slot() = {true, loop};
  commands_.writer.publish();
}

void SwitchedDevice::stop() {
  if (!is_playing_) return;
  is_playing_ = false;
  network_.detach();
  commands_.writer.slot() = {};
  commands_.writer.publish();
}

bool SwitchedDevice::update(std::int64_t now_ns, NeedlePose& pose) {
  if (commands_.reader.update()) {
    const Command& command = commands_.reader.value();
    if (command.plays) script_->restart(command.loops);
    pose.present = pose.button = script_button_ = false;
  }
  if (commands_.reader.value().plays) return update_script(now_ns, pose);
  if (stepper_ && stepper_->has_probe()) return stepper_->update(now_ns, pose);
  return network_.update(now_ns, pose);
}

bool SwitchedDevice::update_script(std::int64_t now_ns, NeedlePose& pose) {
  pose.button = script_button_;  // unchanged if the script has no new pose
  const bool is_fresh = script_->update(now_ns, pose);
  script_button_ = pose.button;
  pressed_.present = pose.present;
  network_.update(now_ns, pressed_);
  pose.button |= pressed_.button;
  pose.load_number = pressed_.load_number;
  pose.load = pressed_.load;
  return is_fresh;
}

}  // namespace brachy
