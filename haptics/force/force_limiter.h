#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/rigid_transform.h"
#include "haptics/force/elapsed.h"

namespace brachy {

/// Defaults for a device that does not state its limits.
inline constexpr double kDefaultMaxForceN = 3.3;  ///< of a Touch
inline constexpr double kMaxSlewNPerMs = 0.5;     ///< never faster, whatever happens
/// after a longer pause too, no more than 1 ms' worth
inline constexpr std::int64_t kLongestSlewNs = 1'000'000;

/// Limits of the force sent to a hand.
struct ForceLimits {
  double max_force_n = kDefaultMaxForceN;  ///< > 0, norm of the vector
  /// N/mm, > 0; of the loop that is closed (haptics/force/negotiation.h).
  double max_stiffness_n_per_mm = std::numeric_limits<double>::infinity();
};

/// The last stage before the hand: limits the norm of the force, limits its change to 0.5 N/ms, and gives no
/// force before the second step (the time since the last step is unknown at the first). A step never changes
/// the force by more than 0.5 N, however long ago the previous one was. For a wanted force that is not finite, or too
/// large for its square to be, the force goes to 0; likewise where the limit is no number above 0.
///
/// Threads: one. Real-time: O(1), no allocation, lock or exception.
class ForceLimiter {
 public:
  /// N, > 0.
  explicit ForceLimiter(double max_force_n = kDefaultMaxForceN) : max_force_n_(checked(max_force_n)) {}

  /// The force to send at `now_ns` (any monotonic clock) for `any_wanted` (N).
  Vec3 step(const Vec3& any_wanted, std::int64_t now_ns) noexcept {
    const bool is_number = std::isfinite(any_wanted.squaredNorm());
    const Vec3 wanted = is_number ? any_wanted : Vec3(Vec3::Zero());
    const double size = wanted.norm();
    clamped_ = size > max_force_n_ || !is_number;
    const Vec3 target = size > max_force_n_ ? Vec3(wanted * (max_force_n_ / size)) : wanted;
    const Vec3 change = target - force_n_;
    const double most = kMaxSlewNPerMs * 1e-6 * static_cast<double>(elapsed(now_ns)), length = change.norm();
    slewed_ = length > most;
    force_n_ = slewed_ ? Vec3(force_n_ + change * (most / length)) : target;
    return force_n_;
  }

  const Vec3& force_n() const { return force_n_; }               ///< result of the last step
  bool clamped() const { return clamped_; }                      ///< the requested force exceeded the limit
  bool slewed() const { return slewed_; }                        ///< the change of force was limited
  void set_max_force_n(double n) { max_force_n_ = checked(n); }  ///< > 0

 private:
  std::int64_t elapsed(std::int64_t now_ns) noexcept {
    const std::int64_t last_ns = started_ ? last_ns_ : now_ns;
    started_ = true;
    last_ns_ = now_ns;
    // Time that goes backwards counts as none.
    return std::min(elapsed_ns(last_ns, now_ns), kLongestSlewNs);
  }

  static double checked(double max_force_n) { return max_force_n > 0 ? max_force_n : 0; }  // NaN too

  double max_force_n_;
  Vec3 force_n_ = Vec3::Zero();
  std::int64_t last_ns_ = 0;
  bool started_ = false, clamped_ = false, slewed_ = false;
};

}  // namespace brachy
