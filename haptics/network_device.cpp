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

bool NetworkDevice::update(std::int64_t /*now_ns*/, NeedlePose& pose) {
  if (!reader_.update()) return false;
  pose = reader_.value();
  return true;
}

}  // namespace brachy
