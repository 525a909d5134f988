#include "haptics/devices/network_device.h"

namespace brachy {

void NetworkDevice::attach() {
  guard_.reset();
  attached_ = true;
}

PoseStatus NetworkDevice::submit(NeedlePose pose) {
  if (!attached_) return guard_.note(PoseStatus::kNotAttached);
  const PoseStatus verdict = guard_.check(pose);
  if (verdict == PoseStatus::kAccepted) {
    pose.present = true;
    poses_.writer.slot() = pose;
    poses_.writer.publish();
  }
  return verdict;
}

void NetworkDevice::detach() {
  press(false);
  attached_ = false;
}

void NetworkDevice::press(bool pressed) {
  if (!attached_ || pressed == (changes_sent_ % 2 == 1)) return;
  changes_.writer.slot() = ++changes_sent_;
  changes_.writer.publish();
}

void NetworkDevice::load(std::int32_t plan_needle) {
  last_load_ = {last_load_.number + 1, plan_needle};
  loads_.writer.slot() = last_load_;
  loads_.writer.publish();
}

bool NetworkDevice::update(std::int64_t /*now_ns*/, NeedlePose& pose) {
  const bool is_fresh = poses_.reader.update();
  if (is_fresh) pose = poses_.reader.value();
  changes_.reader.update();
  if (pose.present && changes_seen_ < changes_.reader.value()) ++changes_seen_;
  pose.button = pose.present && changes_seen_ % 2 == 1;
  loads_.reader.update();
  pose.load_number = loads_.reader.value().number;
  pose.load = loads_.reader.value().plan_needle;
  return is_fresh;
}

}  // namespace brachy
