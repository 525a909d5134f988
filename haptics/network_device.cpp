#include "haptics/network_device.h"

namespace brachy {

void NetworkDevice::attach() {
  guard_.reset();
  attached_ = true;
}

PoseVerdict NetworkDevice::submit(NeedlePose pose) {
  if (!attached_) return guard_.note(PoseVerdict::kNotAttached);
  const PoseVerdict verdict = guard_.check(pose);
  if (verdict == PoseVerdict::kAccepted) {
    pose.present = true;
    writer_.slot() = pose;
    writer_.publish();
  }
  return verdict;
}

void NetworkDevice::detach() {
  press(false);
  attached_ = false;
}

void NetworkDevice::press(bool pressed) {
  if (!attached_ || pressed == (changes_told_ % 2 == 1)) return;
  change_writer_.slot() = ++changes_told_;
  change_writer_.publish();
}

bool NetworkDevice::update(std::int64_t /*now_ns*/, NeedlePose& pose) {
  const bool is_fresh = reader_.update();
  if (is_fresh) pose = reader_.value();
  change_reader_.update();
  if (pose.present && changes_seen_ < change_reader_.value()) ++changes_seen_;
  pose.button = pose.present && changes_seen_ % 2 == 1;
  return is_fresh;
}

}  // namespace brachy
