#include "apps/daemon/forces/force_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "haptics/force/negotiation.h"
#include "haptics/force/received_force.h"

namespace brachy {
namespace {

constexpr double kMaxWireHz = 1000;
constexpr double kMinRateHz = 1;        // a lower one counts as this
constexpr double kMaxRateHz = 100'000;  // a higher one is not plausible
constexpr double kRampS = 1e-9 * static_cast<double>(ForceGateSettings{}.ramp_in_ns);

/// How long a FORCE holds: 50 ms, or two and a half periods of a device slower than that.
std::uint16_t valid_ms(std::int64_t period_ns) {
  const std::int64_t valid_ns = std::max(ReceivedForce::kDefaultValidNs, 5 * period_ns / 2);
  return static_cast<std::uint16_t>(std::min<std::int64_t>(valid_ns / 1'000'000, UINT16_MAX));
}

/// The tissue's forces scaled to the force sent to the hand: cutting and friction keep their shares of the
/// axial part.
NeedleForces sized(const NeedleForces& tissue, const Vec3& force_n, const Vec3& axis) {
  const double full = tissue.force_n.norm(), share = full > 0 ? std::min(force_n.norm() / full, 1.0) : 0;
  NeedleForces hand;
  hand.force_n = force_n;
  hand.tip_torque_nmm = share * tissue.tip_torque_nmm;
  hand.hub_torque_nmm = share * tissue.hub_torque_nmm;
  hand.axial_n = -force_n.dot(axis);
  hand.lateral_n = (force_n + hand.axial_n * axis).norm();
  const double cut = tissue.axial_n > 0 ? std::clamp(tissue.cutting_n / tissue.axial_n, 0.0, 1.0) : 0;
  hand.cutting_n = cut * std::max(hand.axial_n, 0.0);
  hand.friction_n = hand.axial_n - hand.cutting_n;
  return hand;
}

StatedLimits stated_by(const net::DeviceLimits& limits) {
  return {limits.max_force_n, limits.max_stiffness_n_per_mm, limits.damping_n_s_per_mm};
}

/// What a device states that is not believed.
struct Doubt {
  std::uint32_t bit;
  std::string_view name, remark;
  double stated, largest;
};

std::vector<Doubt> doubts_about(const net::DeviceLimits& limits) {
  std::vector<Doubt> doubts = {
      {net::kForceNotPlausible, "max_force_n", "", limits.max_force_n, kLargestForceN},
      {net::kStiffnessNotPlausible, "max_stiffness_n_per_mm", "", limits.max_stiffness_n_per_mm,
       kLargestStiffnessNPerMm},
      {net::kDampingNotPlausible, "damping_n_s_per_mm", "; 1 N·s/m is 0.001", limits.damping_n_s_per_mm,
       kLargestDampingNsPerMm},
      {net::kRateNotPlausible, "rate_hz", "", limits.rate_hz, kMaxRateHz}};
  std::erase_if(doubts, [](const Doubt& d) { return !is_implausible(d.stated, d.largest); });
  return doubts;
}

std::uint32_t implausible_bits(const net::DeviceLimits& limits) {
  std::uint32_t bits = 0;
  for (const Doubt& doubt : doubts_about(limits)) bits |= doubt.bit;
  return bits;
}

/// A sentence; "" where all of it is believed.
std::string implausible(const net::DeviceLimits& limits) {
  std::string text;
  for (const Doubt& d : doubts_about(limits))
    text += fmt::format("{}{} {:g} (at most {:g}{})",
                        text.empty() ? "not plausible, replaced by the default: " : "; ", d.name, d.stated,
                        d.largest, d.remark);
  return text;
}

}  // namespace

std::string negotiated_line(const net::DeviceInfo& device, const net::NegotiatedLimits& limits) {
  return fmt::format("needle {}: '{}' gets at most {:g} N and {:.3g} N/mm, with {:g} N·s/mm at {:g} Hz{}",
                     device.needle, device.name, limits.max_force_n, limits.max_stiffness_n_per_mm,
                     limits.damping_n_s_per_mm, limits.rate_hz,
                     device.evaluates_local_model ? ", by its local model" : "");
}

double ForceLink::Hand::rate_hz() const {
  const double stated = device.limits.rate_hz;
  return is_plausible(stated, kMaxRateHz) ? std::max(stated, kMinRateHz) : kDefaultRateHz;
}

/// A device that evaluates its own force is tracked at 1 kHz, so that the force reported for it is the one it
/// renders.
std::int64_t ForceLink::Hand::period_ns() const {
  const bool is_followed = device.evaluates_local_model || !gate.connected();
  return std::llround(1e9 / (is_followed ? kMaxWireHz : std::min(rate_hz(), kMaxWireHz)));
}

ForceLink::ForceLink(std::size_t needles, ForceLinkOutputs outputs)
    : outputs_(std::move(outputs)), hands_(needles) {
  for (std::size_t n = 0; n < needles; ++n) hands_[n].needle = static_cast<std::uint16_t>(n);
}

void ForceLink::attach(const net::DeviceInfo& device) {
  Hand& hand = hands_[device.needle];
  hand.device = device;
  hand.local = LocalForce({kDefaultMaxForceN, std::numeric_limits<double>::infinity()});
  hand.stiffness = {};
  hand.is_stiffness_limited = false;
  hand.pose.reset();
  hand.next_ns = 0;
  hand.limits = negotiate_with(hand);
  hand.gate.connect(hand.limits.max_force_n);
  if (hand.gate.latched()) announce(hand, "latched by a fault before: no force until it is armed");
  if (const std::string doubts = implausible(device.limits); !doubts.empty()) announce(hand, doubts);
}

net::NegotiatedLimits ForceLink::negotiated(std::uint16_t needle) const {
  const Hand& hand = hands_[needle];
  const ForceLimits limits = negotiate_with(hand);
  return {limits.max_force_n, limits.max_stiffness_n_per_mm, damping_of(stated_by(hand.device.limits)),
          hand.rate_hz(), implausible_bits(hand.device.limits)};
}

void ForceLink::detach(const net::DeviceInfo& device) {
  Hand& hand = hands_[device.needle];
  hand.gate.disconnect(hand.pose && hand.tick.is_in_contact);  // without a pose it never moved the needle
  hand.pose.reset();
  announce_interventions(hand);
}

void ForceLink::arm(std::uint16_t needle, const std::string& client) {
  Hand& hand = hands_[needle];
  if (!hand.gate.latched()) return;
  hand.gate.arm();
  announce(hand, "armed by " + client + ": the force comes back over half a second");
}

void ForceLink::pose_accepted(std::uint16_t needle, const NeedlePose& pose) {
  Hand& hand = hands_[needle];
  if (!hand.pose) hand.first_pose_ns = pose.received_ns;
  hand.pose = pose;
  hand.gate.check(pose.received_ns);  // the gap before this pose counts even if no cycle ran in between
  hand.gate.pose_accepted(pose.received_ns);
}

void ForceLink::pose_not_finite(std::uint16_t needle) {
  hands_[needle].gate.pose_not_finite();
  announce_interventions(hands_[needle]);
}

/// For the loop that is closed: beside the device, or over the wire from its pose through our cycle and its
/// own.
ForceLimits ForceLink::negotiate_with(const Hand& hand) const {
  const StatedLimits stated = stated_by(hand.device.limits);
  if (hand.device.evaluates_local_model) return negotiate(stated, {1 / hand.rate_hz(), 0});
  const double held_s = 1 / std::min(hand.rate_hz(), kMaxWireHz);
  const double way_s = outputs_.round_trip_s(hand.needle).value_or(kUnknownRoundTrip);
  return negotiate(stated, {held_s, way_s + held_s + 1 / hand.rate_hz()});
}

void ForceLink::on_tick(const TickForces& tick, std::int64_t now_ns) {
  if (tick.tick == tick_) return;
  tick_ = tick.tick;
  for (Hand& hand : hands_) {
    hand.tick = tick.needles[hand.needle];
    hand.has_new_tick = true;
    if (hand.gate.connected()) update_model(hand, now_ns);
  }
}

void ForceLink::update_model(Hand& hand, std::int64_t now_ns) {
  hand.limits = negotiate_with(hand);
  // A model of the previous device's pose would act at the wrong place. Until a tick has used a pose of this
  // device, and if the model is not usable, a model without contact: no force.
  const bool is_own = hand.pose && hand.tick.input_received_ns >= hand.first_pose_ns;
  net::LocalModelMessage message;
  if (is_own && is_usable(hand.tick.model)) message.model = hand.tick.model;
  message.model.tick = tick_;
  hand.is_stiffness_limited = hand.stiffness.apply(message.model, hand.limits.max_stiffness_n_per_mm);
  hand.gate.note_stiffness(hand.is_stiffness_limited);

  hand.local.take(message.model, is_own ? hand.tick.input_received_ns : LocalForce::kUnknown, now_ns);
  if (!hand.device.evaluates_local_model) return;

  message.needle = hand.needle;
  const double gain = hand.gate.gain(now_ns);
  message.model = scaled(message.model, gain);
  if (!hand.gate.latched()) message.flags |= net::kForceArmed;
  if (hand.gate.latched()) message.flags |= net::kForceLatched;
  if (!hand.gate.latched() && gain < 1) message.flags |= net::kForceRamping;
  if (hand.is_stiffness_limited) message.flags |= net::kForceLimited;
  if (is_own) {
    message.input_sequence = hand.tick.input_sequence;
    message.input_stamp_ns = hand.tick.input_stamp_ns;
  }
  message.max_force_n = hand.limits.max_force_n;
  message.max_stiffness_n_per_mm = hand.limits.max_stiffness_n_per_mm;
  message.max_slew_n_per_ms = kMaxSlewNPerMs;
  message.ramp_s = kRampS;
  outputs_.send_model(message);
}

void ForceLink::cycle(std::int64_t now_ns) {
  for (Hand& hand : hands_) {
    if (!hand.is_active()) continue;
    hand.gate.check(now_ns);
    const std::int64_t period_ns = hand.period_ns();
    if (now_ns + period_ns / 4 >= hand.next_ns) {  // tolerates a timer that is a little early
      const bool is_late = now_ns - hand.next_ns > period_ns;
      hand.next_ns = (is_late ? now_ns : hand.next_ns) + period_ns;
      send_force(hand, now_ns);
    }
    announce_interventions(hand);
  }
}

void ForceLink::send_force(Hand& hand, std::int64_t now_ns) {
  std::uint32_t did = 0;
  const Vec3 wanted = hand.pose ? hand.local.wanted(hand.pose->X_WN.p, hand.pose->received_ns, now_ns, did)
                                : Vec3(Vec3::Zero());
  const double gain = hand.gate.gain(now_ns);
  hand.force_n = hand.gate.pass(wanted, now_ns);
  const bool is_due = !hand.device.evaluates_local_model || hand.has_new_tick;
  if (!hand.gate.connected() || !is_due) return;
  hand.has_new_tick = false;

  net::ForceMessage message;
  message.needle = hand.needle;
  message.tick = tick_;
  message.valid_ms = valid_ms(hand.period_ns());
  const bool is_clamped = gain * wanted.norm() > hand.limits.max_force_n;
  const bool is_ramping = gain < 1 || (!is_clamped && (hand.force_n - wanted).norm() > 1e-9);
  if (!hand.gate.latched()) message.flags |= net::kForceArmed;
  if (hand.gate.latched()) message.flags |= net::kForceLatched;
  if (hand.gate.latched() ? !hand.force_n.isZero(0) : is_ramping) message.flags |= net::kForceRamping;
  if (is_clamped || hand.is_stiffness_limited) message.flags |= net::kForceLimited;
  if (did & kLocalExpired) message.flags |= net::kForceExpired;
  if (hand.pose) {
    message.input_sequence = hand.pose->sequence;
    message.input_stamp_ns = hand.pose->stamp_ns;
    const NeedleForces& tissue = hand.tick.forces;
    message.forces =
        sized(tissue.is_finite() ? tissue : NeedleForces{}, hand.force_n, hand.pose->X_WN.R.col(2));
  }
  outputs_.send_force(message);
}

void ForceLink::announce_interventions(Hand& hand) {
  Intervention intervention{};
  while (hand.gate.next_announcement(intervention)) announce(hand, std::string(to_string(intervention)));
}

void ForceLink::announce(const Hand& hand, const std::string& what) const {
  const std::string whose = hands_.size() > 1 ? "needle " + std::to_string(hand.needle) + ": " : "";
  outputs_.announce({net::EventKind::kSafety, hand.needle, tick_, whose + what});
}

bool ForceLink::is_active() const {
  return std::any_of(hands_.begin(), hands_.end(), [](const Hand& hand) { return hand.is_active(); });
}

std::int64_t ForceLink::period_ns() const {
  std::int64_t fastest = 20'000'000;  // faults are checked for at 50 Hz at least
  for (const Hand& hand : hands_)
    if (hand.is_active()) fastest = std::min(fastest, hand.period_ns());
  return fastest;
}

std::array<std::uint64_t, kInterventions> ForceLink::interventions() const {
  std::array<std::uint64_t, kInterventions> counts{};
  for (const Hand& hand : hands_)
    for (std::size_t i = 0; i < kInterventions; ++i)
      counts[i] += hand.gate.count(static_cast<Intervention>(i));
  return counts;
}

void ForceLink::add_to(net::StateMessage& state) const {
  for (const Hand& hand : hands_) {
    for (std::size_t i = 0; i < kInterventions; ++i) {
      const auto intervention = static_cast<Intervention>(i);
      if (const std::uint64_t count = hand.gate.count(intervention))
        state.safety.push_back(
            {hand.needle, static_cast<std::uint16_t>(i), count, std::string(to_string(intervention))});
    }
  }
}

}  // namespace brachy
