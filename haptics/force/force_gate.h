#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "haptics/force/force_limiter.h"

namespace brachy {

/// What the gate did between the simulation and a hand. Goes over the wire and indexes counters: append only.
enum class Intervention : std::uint8_t {
  kNotFinite = 0,         ///< fault: the device sent a pose with NaN or infinity
  kStale = 1,             ///< fault: no accepted pose for ForceGateSettings::stale_ns
  kDisconnected = 2,      ///< fault: the device went while its needle was in contact
  kForceLimited = 3,      ///< more was asked for than the force limit
  kSlewLimited = 4,       ///< the force had to go slower than asked
  kStiffnessLimited = 5,  ///< a model was stiffer than the loop renders stably
};
inline constexpr std::size_t kInterventions = 6;
/// As summaries and metrics call them.
inline constexpr std::array<const char*, kInterventions> kInterventionNames = {
    "not_finite", "stale", "disconnected", "force_limited", "slew_limited", "stiffness_limited"};

/// A sentence for the operator that names the fix.
std::string_view to_string(Intervention intervention);

struct ForceGateSettings {
  std::int64_t stale_ns = 50'000'000;     ///< > 0
  std::int64_t ramp_in_ns = 500'000'000;  ///< > 0
};

/// The safety of one needle's force: what of the simulation's force its hand gets.
///
/// After connect() or arm() the gain rises from 0 to 1 over half a second from the first accepted pose on: who connects
/// inside feels nothing at first. A fault takes the force to 0 at 0.5 N/ms and latches: nothing until arm(), also not
/// for the next device. Only a disconnect out of contact does not latch.
///
/// Every intervention is counted; next_announcement() gives those that nobody has been told of: each fault, and each
/// kind of limit once a connection. A limit that holds for many cycles in a row counts once.
///
/// Threads: one. Real-time: O(1), no allocation, lock or exception. It reads no clock: times are the caller's.
class ForceGate {
 public:
  explicit ForceGate(const ForceGateSettings& settings = {}) : settings_(settings) {}

  /// A device took the needle. `max_force_n` as negotiated, > 0.
  void connect(double max_force_n);
  void disconnect(bool in_contact);
  /// Lets the force in anew after a fault; without one it changes nothing.
  void arm();

  void pose_accepted(std::int64_t now_ns);
  void pose_not_finite();
  /// The model that the needle's force is worked out from had to be made softer, or not.
  void note_stiffness(bool limited) { note(Intervention::kStiffnessLimited, limited); }

  /// Looks for staleness: once a cycle. pass() does it too.
  void check(std::int64_t now_ns);

  /// How much of the force the hand gets, 0 … 1: for a device that works out its own (`scaled`), which limits the slew.
  double gain(std::int64_t now_ns) const;

  /// What the hand gets of `wanted` (N; not finite: none) now. While nobody is connected, keep calling until it is 0.
  Vec3 pass(const Vec3& wanted, std::int64_t now_ns);

  bool connected() const { return connected_; }
  bool latched() const { return latched_; }  ///< until arm()
  std::uint64_t count(Intervention i) const { return counts_[static_cast<std::size_t>(i)]; }

  /// Takes out one that is to be announced; false: there is none.
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
