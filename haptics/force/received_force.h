#pragma once

#include <algorithm>
#include <cstdint>

#include "haptics/force/elapsed.h"
#include "haptics/force/force_limiter.h"

namespace brachy {

/// Beside a device that renders the forces it receives (FORCE, net/PROTOCOL.md): the force to render now. A force has
/// a time to live: where no newer one comes, because the daemon stopped, died or cannot be reached, the force goes to 0
/// at 0.5 N/ms and stays there, latched. A driver needs this header and two calls, and arm() where it sends ARM:
///
///     ReceivedForce received(max_force_n);
///     at FORCE:     received.take(force_n, valid_ms, is_latched, now_ns);
///     every cycle:  force_n = received.evaluate(now_ns);
///
/// Whatever comes, the force is finite, its norm at most `max_force_n`, and its change at most 0.5 N/ms.
///
/// Threads: one. Real-time: O(1), no allocation, lock or exception. It reads no clock: times are the caller's, of one
/// monotonic clock.
class ReceivedForce {
 public:
  static constexpr std::int64_t kDefaultValidNs = 50'000'000;     ///< of a FORCE that states no validity
  static constexpr std::int64_t kLongestValidNs = 5'000'000'000;  ///< a longer one is cut to this
  static constexpr std::int64_t kRampNs = 500'000'000;            ///< gain 0 → 1 after a latch

  /// N, > 0.
  explicit ReceivedForce(double max_force_n = kDefaultMaxForceN) : limiter_(max_force_n) {}

  /// A FORCE arrived, valid for `valid_ms` (0: not stated) from now on. `is_latched`: the flag of that name. False for
  /// a force that is not finite; the last one stays, and its time runs on.
  bool take(const Vec3& force_n, std::uint32_t valid_ms, bool is_latched, std::int64_t now_ns) noexcept {
    if (!force_n.allFinite()) return false;
    check(now_ns);  // a force that comes too late does not revive the one before
    if (is_server_latched_ && !is_latched) rearm();
    is_server_latched_ = is_latched;
    force_n_ = force_n;
    has_force_ = true;
    taken_ns_ = now_ns;
    valid_ns_ = valid_ms == 0 ? kDefaultValidNs
                              : std::min<std::int64_t>(std::int64_t{valid_ms} * 1'000'000, kLongestValidNs);
    return true;
  }

  /// The force to render now, N. To be called each cycle.
  Vec3 evaluate(std::int64_t now_ns) noexcept {
    check(now_ns);
    Vec3 wanted = Vec3::Zero();
    if (has_force_ && !is_latched_) wanted = gain(now_ns) * force_n_;
    return limiter_.step(wanted, now_ns);
  }

  /// The connection is lost: the force goes to 0 now and latches.
  void lose() noexcept {
    is_latched_ = is_latched_ || has_force_;
    has_force_ = false;
  }

  /// The user ends the latch; to be called where ARM is sent. Without a latch it changes nothing. Another way out is a
  /// latch of the server's, of which the flags of FORCE tell, that was ended: by an operator, for instance.
  void arm() noexcept {
    if (is_latched_) rearm();
  }

  bool is_latched() const { return is_latched_; }

 private:
  void check(std::int64_t now_ns) noexcept {
    if (has_force_ && elapsed_ns(taken_ns_, now_ns) > valid_ns_) lose();
  }

  void rearm() noexcept {
    is_latched_ = has_force_ = false;
    is_ramping_ = true;
    ramp_ns_ = kNotStarted;
  }

  double gain(std::int64_t now_ns) noexcept {
    if (!is_ramping_) return 1;
    if (ramp_ns_ == kNotStarted) ramp_ns_ = now_ns;
    const std::int64_t ns = elapsed_ns(ramp_ns_, now_ns);
    is_ramping_ = ns < kRampNs;
    return is_ramping_ ? static_cast<double>(ns) / static_cast<double>(kRampNs) : 1;
  }

  static constexpr std::int64_t kNotStarted = INT64_MIN;

  ForceLimiter limiter_;
  Vec3 force_n_ = Vec3::Zero();
  std::int64_t taken_ns_ = 0, valid_ns_ = kDefaultValidNs, ramp_ns_ = kNotStarted;
  bool has_force_ = false;  // received and valid
  bool is_latched_ = false, is_server_latched_ = false, is_ramping_ = false;
};

}  // namespace brachy
