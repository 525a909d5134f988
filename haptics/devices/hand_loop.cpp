#include "haptics/devices/hand_loop.h"

#include <algorithm>
#include <cmath>

namespace brachy {

HandLoop::HandLoop(HandDevice& device, const HandMapping& mapping)
    : device_(device),
      mapping_(mapping),
      local_({device.facts().max_force_n}),
      first_tip_mm_(mapping.start_tip_mm),
      tip_mm_(mapping.start_tip_mm) {}

std::optional<HandLoop::Cycle> HandLoop::run(std::int64_t now_ns) {
  HandReading reading;
  // With a scale the needle's work is not the hand's: the same force, as a hand that holds the needle itself feels.
  if (!device_.exchange(mapping_.R_WD.transpose() * force_n_, reading)) {
    force_n_.setZero();
    return std::nullopt;
  }
  Cycle cycle;
  cycle.X_WN = place(reading, now_ns);
  const bool is_down = cycle.X_WN && reading.button;  // a hand that is not there presses nothing
  if (is_down != button_) cycle.button = button_ = is_down;
  // A tip that is not finite takes the force away, and so does the silence of a model that has expired.
  const Vec3 tip = is_connected_ && cycle.X_WN ? cycle.X_WN->p : Vec3::Constant(NAN);
  force_n_ = local_.evaluate(tip, now_ns).force_n;
  cycle.force_n = force_n_;
  return cycle;
}

std::optional<RigidTransform> HandLoop::place(const HandReading& reading, std::int64_t now_ns) {
  if (!reading.p_DN.allFinite() || (reading.R_DN && !reading.R_DN->allFinite())) return std::nullopt;
  if (!first_mm_ || elapsed_ns(seen_ns_, now_ns) > kLongestAbsenceNs) {
    first_mm_ = reading.p_DN;
    first_tip_mm_ = tip_mm_;
  }
  seen_ns_ = now_ns;
  RigidTransform X_WN;
  X_WN.p = tip_mm_ = first_tip_mm_ + mapping_.scale * (mapping_.R_WD * (reading.p_DN - *first_mm_));
  if (reading.R_DN) X_WN.R = mapping_.R_WD * *reading.R_DN;
  return X_WN;
}

void HandLoop::take(const LocalContactModel& model, std::int64_t pose_stamp_ns, std::int64_t now_ns) {
  is_connected_ = true;
  LocalContactModel shorter = model;
  shorter.time_to_live_s = std::min(model.time_to_live_s, 1e-9 * static_cast<double>(kLongestSilenceNs));
  local_.take(shorter, pose_stamp_ns, now_ns);
}

}  // namespace brachy
