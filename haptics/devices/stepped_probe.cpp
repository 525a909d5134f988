#include "haptics/devices/stepped_probe.h"

#include <algorithm>

namespace brachy {
namespace {

constexpr double kLongestStepS = 0.1;  // where ticks were missed for longer it does not catch up

}  // namespace

bool SteppedProbe::has_probe() {
  commands_.reader.update();
  const bool is_on = commands_.reader.value().is_on;
  if (!is_on) was_on_ = false;
  return is_on;
}

bool SteppedProbe::update(std::int64_t now_ns, NeedlePose& pose) {
  if (!was_on_) {
    was_on_ = true;
    stepper_ = {};
    last_ns_ = now_ns;
    pose.button = false;
    if (pose.present) {
      pose.present = false;
      return true;
    }
  } else {
    const double dt_s = 1e-9 * static_cast<double>(now_ns - last_ns_);
    const StepperPlace before = stepper_.place();
    last_ns_ = now_ns;
    stepper_.move(commands_.reader.value().place, std::clamp(dt_s, 0.0, kLongestStepS));
    if (pose.present && stepper_.place() == before) return false;
  }
  pose.X_WN = stepper_.pose(X_WR_);
  pose.sequence = ++sequence_;
  pose.stamp_ns = pose.received_ns = now_ns;
  pose.present = true;
  return true;
}

}  // namespace brachy
