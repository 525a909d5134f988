#include "haptics/force/force_gate.h"

#include <algorithm>

#include "haptics/force/elapsed.h"

namespace brachy {

std::string_view to_string(Intervention intervention) {
  switch (intervention) {
    case Intervention::kNotFinite:
      return "pose has NaN or infinity: force removed; repair the tracking, then arm";
    case Intervention::kStale:
      return "no pose for 50 ms: force removed; send poses at 20 Hz or more, then arm";
    case Intervention::kDisconnected:
      return "device lost in contact: force removed; connect, then arm";
    case Intervention::kForceLimited:
      return "force limited to the device's maximum; state a higher max_force_n if it can take more";
    case Intervention::kSlewLimited:
      return "change of force limited to 0.5 N/ms; move slower, or soften the tissue";
    case Intervention::kStiffnessLimited:
      return "stiffness limited to what the loop renders stably; evaluate the local model, raise the rate, "
             "or "
             "state more "
             "damping";
  }
  return "unknown intervention";
}

void ForceGate::connect(double max_force_n) {
  connected_ = true;
  has_pose_ = false;
  limiter_ = ForceLimiter(max_force_n);  // a new hand starts without force
  for (const Intervention limit :
       {Intervention::kForceLimited, Intervention::kSlewLimited, Intervention::kStiffnessLimited}) {
    holds_[static_cast<std::size_t>(limit)] = announced_[static_cast<std::size_t>(limit)] = false;
  }
}

void ForceGate::disconnect(bool in_contact) {
  if (!connected_) return;
  connected_ = false;
  if (in_contact) fail(Intervention::kDisconnected);
}

void ForceGate::arm() {
  if (!latched_) return;
  latched_ = false;
  has_pose_ = false;
}

void ForceGate::pose_accepted(std::int64_t now_ns) {
  if (!has_pose_) ramp_ns_ = now_ns;
  has_pose_ = true;
  pose_ns_ = now_ns;
}

void ForceGate::pose_not_finite() {
  fail(Intervention::kNotFinite);
}

void ForceGate::check(std::int64_t now_ns) {
  if (connected_ && has_pose_ && !latched_ && elapsed_ns(pose_ns_, now_ns) > settings_.stale_ns)
    fail(Intervention::kStale);
}

double ForceGate::gain(std::int64_t now_ns) const {
  if (!connected_ || latched_ || !has_pose_) return 0;
  const double ramp =
      static_cast<double>(elapsed_ns(ramp_ns_, now_ns)) / static_cast<double>(settings_.ramp_in_ns);
  return std::clamp(ramp, 0.0, 1.0);
}

Vec3 ForceGate::pass(const Vec3& wanted, std::int64_t now_ns) {
  check(now_ns);
  const double share = wanted.allFinite() ? gain(now_ns) : 0;
  Vec3 force_n = limiter_.step(share > 0 ? Vec3(share * wanted) : Vec3(Vec3::Zero()), now_ns);
  if (share > 0) {  // the decay to 0 after a fault is not a limit of its own
    note(Intervention::kForceLimited, limiter_.clamped());
    note(Intervention::kSlewLimited, limiter_.slewed());
  }
  return force_n;
}

// A fault while latched is counted, but not announced before the next arm().
void ForceGate::fail(Intervention fault) {
  const auto i = static_cast<std::size_t>(fault);
  ++counts_[i];
  if (!latched_) pending_[i] = true;
  latched_ = true;
}

void ForceGate::note(Intervention limit, bool holds) {
  const auto i = static_cast<std::size_t>(limit);
  if (holds && !holds_[i]) ++counts_[i];
  holds_[i] = holds;
  if (holds && !announced_[i]) pending_[i] = announced_[i] = true;
}

bool ForceGate::next_announcement(Intervention& intervention) {
  const auto found = std::ranges::find(pending_, true);
  if (found == pending_.end()) return false;
  *found = false;
  intervention = static_cast<Intervention>(found - pending_.begin());
  return true;
}

}  // namespace brachy
