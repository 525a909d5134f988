#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "core/math/rigid_transform.h"

namespace brachy {

/// Where a device does not say what it can take.
inline constexpr double kDefaultMaxForceN = 3.3;  ///< a Touch's
inline constexpr double kMaxSlewNPerMs = 0.5;     ///< never faster, whatever happens
inline constexpr std::int64_t kLongestSlewNs =
    1'000'000;  ///< after a longer pause too, no more than 1 ms' worth

/// What a hand may get.
struct ForceLimits {
  double max_force_n = kDefaultMaxForceN;  ///< > 0, of the vector's length
  /// N/mm, > 0; of the loop that is closed (haptics/force/negotiation.h).
  double max_stiffness_n_per_mm = std::numeric_limits<double>::infinity();
};

/// The last thing before the hand: no force longer than the limit, none that changes faster than 0.5 N/ms, and none
/// at all before the second step (of the first no time is known). A step never jumps by more than 0.5 N either,
/// however long ago the one before it was.
///
/// Threads: one. Real-time: O(1), no allocation, lock or exception.
class ForceLimiter {
 public:
  /// N, > 0.
  explicit ForceLimiter(double max_force_n = kDefaultMaxForceN) : max_force_n_(max_force_n) {}

  /// What the hand gets at `now_ns` (any monotonic clock) when `wanted` (finite, N) is asked for.
  Vec3 step(const Vec3& wanted, std::int64_t now_ns) noexcept {
    const double size = wanted.norm();
    clamped_ = size > max_force_n_;
    const Vec3 target = clamped_ ? Vec3(wanted * (max_force_n_ / size)) : wanted;
    const Vec3 change = target - force_n_;
    const double most = kMaxSlewNPerMs * 1e-6 * static_cast<double>(elapsed(now_ns)), length = change.norm();
    slewed_ = length > most;
    force_n_ = slewed_ ? Vec3(force_n_ + change * (most / length)) : target;
    return force_n_;
  }

  const Vec3& force_n() const { return force_n_; }      ///< what the last step gave
  bool clamped() const { return clamped_; }             ///< it was asked for more than the limit
  bool slewed() const { return slewed_; }               ///< it had to go slower than asked
  void set_max_force_n(double n) { max_force_n_ = n; }  ///< > 0

 private:
  std::int64_t elapsed(std::int64_t now_ns) noexcept {
    const std::int64_t last_ns = started_ ? last_ns_ : now_ns;
    started_ = true;
    last_ns_ = now_ns;
    // A clock that goes backwards gives no time; the difference of extreme stamps is not formed.
    if (now_ns <= last_ns) return 0;
    if (last_ns < now_ns - kLongestSlewNs) return kLongestSlewNs;
    return now_ns - last_ns;
  }

  double max_force_n_;
  Vec3 force_n_ = Vec3::Zero();
  std::int64_t last_ns_ = 0;
  bool started_ = false, clamped_ = false, slewed_ = false;
};

}  // namespace brachy
