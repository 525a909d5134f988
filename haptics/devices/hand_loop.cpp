#include "haptics/devices/hand_loop.h"

#include <algorithm>
#include <cmath>

namespace brachy {

HandLoop::HandLoop(HandDevice& device, const HandMapping& mapping)
    : device_(device), mapping_(mapping), local_({device.facts().max_force_n}) {}

std::optional<HandLoop::Cycle> HandLoop::run(std::int64_t now_ns) {
  HandReading reading;
  // With a scale the needle's work is not the hand's: the same force, as a hand that holds the needle itself feels.
  if (!device_.exchange(mapping_.R_WD.transpose() * force_n_, reading)) {
    force_n_.setZero();
    return std::nullopt;
  }
  if (!first_mm_) first_mm_ = reading.X_DN.p;
  Cycle cycle;
  cycle.X_WN.p = mapping_.start_tip_mm + mapping_.scale * (mapping_.R_WD * (reading.X_DN.p - *first_mm_));
  cycle.X_WN.R = mapping_.R_WD * reading.X_DN.R;
  if (reading.button != button_) cycle.button = button_ = reading.button;
  // A tip that is not finite takes the force away, and so does the silence of a model that has expired.
  const Vec3 tip = is_connected_ ? cycle.X_WN.p : Vec3::Constant(NAN);
  force_n_ = local_.evaluate(tip, now_ns).force_n;
  cycle.force_n = force_n_;
  return cycle;
}

void HandLoop::take(const LocalContactModel& model, std::int64_t pose_stamp_ns, std::int64_t now_ns) {
  is_connected_ = true;
  LocalContactModel shorter = model;
  shorter.time_to_live_s = std::min(model.time_to_live_s, 1e-9 * static_cast<double>(kLongestSilenceNs));
  local_.take(shorter, pose_stamp_ns, now_ns);
}

}  // namespace brachy
