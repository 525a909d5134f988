#include "haptics/devices/scripted_device.h"

#include <cassert>
#include <cmath>
#include <utility>

namespace brachy {

ScriptedDevice::ScriptedDevice(Trajectory trajectory, bool loop)
    : trajectory_(std::move(trajectory)),
      loop_(loop),
      start_s_(trajectory_.start_s()),
      duration_ns_(std::llround(trajectory_.duration_s() * 1e9)) {}

ScriptedDevice::ScriptedDevice(Trajectory trajectory, bool loop, double start_s, double end_s)
    : trajectory_(std::move(trajectory)),
      loop_(loop),
      start_s_(start_s),
      duration_ns_(std::llround((end_s - start_s) * 1e9)) {
  assert(start_s <= trajectory_.start_s() && trajectory_.end_s() <= end_s);
}

void ScriptedDevice::restart(bool loop) {
  loop_ = loop;
  started_ = finished_ = false;
  last_s_ = kBeforeAll;
}

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
  const double t_s = start_s_ + static_cast<double>(elapsed_ns) * 1e-9;
  const double last_s = std::exchange(last_s_, t_s);
  if (t_s < trajectory_.start_s() - kSameTime) {
    pose.button = false;
    return std::exchange(pose.present, false);
  }
  pose.X_WN = trajectory_.sample(t_s);
  pose.button = trajectory_.button(last_s < t_s ? last_s : kBeforeAll, t_s);
  pose.sequence = ++sequence_;
  pose.stamp_ns = now_ns;
  pose.received_ns = now_ns;
  pose.present = true;
  return true;
}

}  // namespace brachy
