#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "haptics/force/force_limiter.h"

namespace brachy {

/// Interventions of the gate between the simulation and a hand. Sent over the wire and used as an index of
/// counters: append only.
enum class Intervention : std::uint8_t {
  kNotFinite = 0,         ///< fault: the device sent a pose with NaN or infinity
  kStale = 1,             ///< fault: no accepted pose for ForceGateSettings::stale_ns
  kDisconnected = 2,      ///< fault: the device disconnected while its needle was in contact
  kForceLimited = 3,      ///< the requested force exceeded the limit
  kSlewLimited = 4,       ///< the change of force was limited
  kStiffnessLimited = 5,  ///< a model was stiffer than the loop renders stably
};
inline constexpr std::size_t kInterventions = 6;
/// Names in summaries and metrics.
inline constexpr std::array<const char*, kInterventions> kInterventionNames = {
    "not_finite", "stale", "disconnected", "force_limited", "slew_limited", "stiffness_limited"};

/// A sentence for the operator that names the fix.
std::string_view to_string(Intervention intervention);

struct ForceGateSettings {
  std::int64_t stale_ns = 50'000'000;     ///< > 0
  std::int64_t ramp_in_ns = 500'000'000;  ///< > 0
};

/// The safety of one needle's force: decides how much of the simulation's force is sent to its hand.
///
/// After connect() or arm() the gain rises from 0 to 1 over half a second from the first accepted pose on: a
/// device that connects inside the tissue starts without force. A fault takes the force to 0 at 0.5 N/ms and
/// latches: no force until arm(), also not for the next device. Only a disconnect out of contact does not
/// latch.
///
/// Every intervention is counted; next_announcement() returns those to report to clients: each fault, and
/// each kind of limit once per connection. A limit that holds for many cycles in a row counts once.
///
/// Threads: one. Real-time: O(1), no allocation, lock or exception. It reads no clock: times are the
/// caller's.
class ForceGate {
 public:
  explicit ForceGate(const ForceGateSettings& settings = {}) : settings_(settings) {}

  /// A device took the needle. `max_force_n` as negotiated, > 0.
  void connect(double max_force_n);
  void disconnect(bool in_contact);
  /// Enables the force again after a fault; without one it changes nothing.
  void arm();

  void pose_accepted(std::int64_t now_ns);
  void pose_not_finite();
  /// Whether the model from which the needle's force is evaluated had to be softened.
  void note_stiffness(bool limited) { note(Intervention::kStiffnessLimited, limited); }

  /// Checks for staleness; to be called once a cycle. pass() includes it.
  void check(std::int64_t now_ns);

  /// The share of the force that is sent, 0 … 1: for a device that evaluates its own force (`scaled`) and
  /// limits the slew itself.
  double gain(std::int64_t now_ns) const;

  /// The force to send now for `wanted` (N; none if not finite). After a disconnect keep calling until it is
  /// 0.
  Vec3 pass(const Vec3& wanted, std::int64_t now_ns);

  bool connected() const { return connected_; }
  bool latched() const { return latched_; }  ///< until arm()
  std::uint64_t count(Intervention i) const { return counts_[static_cast<std::size_t>(i)]; }

  /// Removes the next intervention to announce; false if there is none.
  bool next_announcement(Intervention& intervention);

 private:
  void fail(Intervention fault);
  void note(Intervention limit, bool holds);

  ForceGateSettings settings_;
  ForceLimiter limiter_;
  bool connected_ = false, latched_ = false;
  bool has_pose_ = false;     // since connect or arm
  std::int64_t ramp_ns_ = 0;  // its arrival
  std::int64_t pose_ns_ = 0;  // of the last accepted one
  std::array<std::uint64_t, kInterventions> counts_{};
  std::array<bool, kInterventions> holds_{}, announced_{}, pending_{};
};

}  // namespace brachy
