#include "haptics/scripted_device.h"

#include <cmath>
#include <utility>

namespace brachy {

ScriptedDevice::ScriptedDevice(Trajectory trajectory, bool loop)
    : trajectory_(std::move(trajectory)),
      loop_(loop),
      duration_ns_(std::llround(trajectory_.duration_s() * 1e9)) {}

bool ScriptedDevice::update(std::int64_t now_ns, NeedlePose& pose) {
  if (finished_) return false;
  if (!started_) {
    started_ = true;
    start_ns_ = now_ns;
  }
  std::int64_t elapsed_ns = now_ns - start_ns_;
  if (loop_) {
    if (duration_ns_ > 0) elapsed_ns %= duration_ns_;
  } else {
    finished_ = elapsed_ns >= duration_ns_;
  }
  pose.X_WN = trajectory_.sample(trajectory_.start_s() + static_cast<double>(elapsed_ns) * 1e-9);
  pose.sequence = ++sequence_;
  pose.stamp_ns = now_ns;
  pose.received_ns = now_ns;
  pose.present = true;
  return true;
}

}  // namespace brachy
