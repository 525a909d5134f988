#pragma once

#include <array>
#include <cstdint>

#include "core/needle/local_contact_model.h"
#include "haptics/force/force_limiter.h"
#include "haptics/force/model_limits.h"

namespace brachy {

/// Actions of LocalForce::evaluate; bits of DeviceForce::flags.
enum LocalForceFlag : std::uint32_t {
  kLocalExpired = 1u << 0,           ///< no model, or it exceeded its time to live: the force goes to 0
  kLocalNotFinite = 1u << 1,         ///< the tip is NaN, infinite or beyond kFarthestMm: the force goes to 0
  kLocalClamped = 1u << 2,           ///< the requested force exceeded the limit
  kLocalSlewed = 1u << 3,            ///< the change of force was limited to 0.5 N/ms
  kLocalStiffnessLimited = 1u << 4,  ///< the model was stiffer than the limit
};

struct DeviceForce {
  Vec3 force_n = Vec3::Zero();  ///< on the needle, at its tip, world frame: no torque about the tip
  std::uint32_t flags = 0;      ///< LocalForceFlag bits

  /// About another point of the device (mm, world frame), N·mm.
  Vec3 moment_about(const Vec3& point, const Vec3& tip) const { return (tip - point).cross(force_n); }
};

/// Beside the device: the force at 1 kHz or more from the newest LocalContactModel, as
/// core/needle/local_contact_model.h defines it. A driver needs this header and three calls:
///
///     LocalForce local(limits);
///     every cycle:       force = local.evaluate(tip, now_ns);  client.send_pose(X_WN, now_ns);
///     at LOCAL_MODEL:    local.take(model, input_stamp_ns, now_ns);
/// A model belongs to a pose the device sent some time ago. Since then the needle may have advanced, slipped
/// or turned back: take() drags the model's contact point through the tips recorded since that pose, so that
/// a late model gives the same force as one without delay. Otherwise a hand that turns back would feel the
/// friction of the previous direction for as long as the network's delay, and friction in the direction of
/// motion feeds an oscillation.
///
/// Whatever comes, model, tip or time, the force is finite, its norm does not exceed the limit, and it changes by at
/// most 0.5 N/ms. Limits that are no numbers above 0 give no force.
///
/// Threads: one. Real-time: no allocation, lock or exception; evaluate O(1), take O(tips since its pose) ≤
/// kTips.
class LocalForce {
 public:
  static constexpr std::size_t kTips = 512;  ///< tips stored: half a second at 1 kHz
  static constexpr std::int64_t kUnknown = INT64_MIN;

  explicit LocalForce(const ForceLimits& limits = {}) : limits_(limits), limiter_(limits.max_force_n) {}

  /// A model arrived. `pose_stamp_ns` is the stamp that evaluate() received with the pose of the model
  /// (kUnknown: the model is used at the present tip unchanged). Returns false for a model that is not
  /// usable; the last one stays.
  bool take(const LocalContactModel& model, std::int64_t pose_stamp_ns, std::int64_t now_ns) noexcept {
    if (!is_usable(model) || !(limits_.max_stiffness_n_per_mm > 0)) return false;
    model_ = model;
    model_.time_to_live_s = std::min(model_.time_to_live_s, kLongestTimeToLiveS);
    stiffness_limited_ = stiffness_limiter_.apply(model_, limits_.max_stiffness_n_per_mm);
    arrived_ns_ = now_ns;
    has_model_ = true;
    if (pose_stamp_ns != kUnknown) drag_through_tips_since(pose_stamp_ns);
    return true;
  }

  /// The force with the needle's tip (world frame, mm) at `tip` now.
  DeviceForce evaluate(const Vec3& tip, std::int64_t now_ns) noexcept {
    return evaluate(tip, now_ns, now_ns);
  }
  /// The same for a tip of a pose stamped by another clock.
  DeviceForce evaluate(const Vec3& tip, std::int64_t pose_stamp_ns, std::int64_t now_ns) noexcept {
    DeviceForce result;
    result.force_n = limiter_.step(wanted(tip, pose_stamp_ns, now_ns, result.flags), now_ns);
    if (limiter_.clamped()) result.flags |= kLocalClamped;
    if (limiter_.slewed()) result.flags |= kLocalSlewed;
    return result;
  }

  /// The model's force alone, without limits of norm and slew, for callers with their own limiter
  /// (ForceGate); adds to `flags`.
  Vec3 wanted(const Vec3& tip, std::int64_t pose_stamp_ns, std::int64_t now_ns,
              std::uint32_t& flags) noexcept {
    if (!is_place(tip)) {
      flags |= kLocalNotFinite;
      return Vec3::Zero();
    }
    remember(tip, pose_stamp_ns);
    if (has_model_ && static_cast<double>(elapsed_ns(arrived_ns_, now_ns)) > 1e9 * model_.time_to_live_s)
      has_model_ = false;
    if (!has_model_) {
      flags |= kLocalExpired;
      return Vec3::Zero();
    }
    if (stiffness_limited_) flags |= kLocalStiffnessLimited;
    drag(tip);
    return force_at(tip);
  }

  const LocalContactModel& model() const { return model_; }  ///< with the contact point as dragged so far
  bool has_model() const { return has_model_; }  ///< and it had not expired at the last evaluate()

 private:
  struct StampedTip {
    Vec3 tip;
    std::int64_t stamp_ns;
  };

  double beyond(const Vec3& tip) const { return (tip - model_.contact_point).dot(model_.axis); }

  // Slip: if the spring exceeds a limit, the contact point follows the tip.
  void drag(const Vec3& tip) noexcept {
    if (!model_.in_contact && !model_.is_capsule) return;
    const double k = model_.axial_stiffness_n_per_mm, z = beyond(tip);
    if (k * z > model_.axial_max_n) {
      if (model_.is_capsule) puncture();
      model_.contact_point += std::max(z - model_.axial_max_n / k, 0.0) * model_.axis;
    } else if (model_.axial_min_n < 0 && k * z < model_.axial_min_n) {
      model_.contact_point += (z - model_.axial_min_n / k) * model_.axis;
    }
  }

  void puncture() noexcept {
    model_.is_capsule = false;
    model_.in_contact = true;
    model_.axial_max_n = std::min(model_.axial_max_n, model_.after_puncture_n);
  }

  Vec3 force_at(const Vec3& tip) const noexcept {
    const double z = beyond(tip);
    const bool touches = only_pushes(model_) ? z > 0 : model_.in_contact;
    if (!touches) return Vec3::Zero();
    const double axial =
        std::clamp(model_.axial_stiffness_n_per_mm * z, model_.axial_min_n, model_.axial_max_n);
    const Vec3 moved = tip - model_.reference_tip;
    const Vec3 across = moved - moved.dot(model_.axis) * model_.axis;
    return model_.lateral_n - model_.lateral_stiffness_n_per_mm * across - axial * model_.axis;
  }

  void remember(const Vec3& tip, std::int64_t stamp_ns) noexcept {
    if (tips_seen_ > 0 && stamp_ns <= tips_[(tips_seen_ - 1) % kTips].stamp_ns) return;
    tips_[tips_seen_++ % kTips] = {tip, stamp_ns};
  }

  void drag_through_tips_since(std::int64_t stamp_ns) noexcept {
    const std::uint64_t oldest = tips_seen_ > kTips ? tips_seen_ - kTips : 0;
    std::uint64_t first = tips_seen_;
    while (first > oldest && tips_[(first - 1) % kTips].stamp_ns > stamp_ns) --first;
    for (std::uint64_t i = first; i < tips_seen_; ++i) drag(tips_[i % kTips].tip);
  }

  ForceLimits limits_;
  LocalContactModel model_;
  bool has_model_ = false, stiffness_limited_ = false;
  std::int64_t arrived_ns_ = 0;
  StiffnessLimiter stiffness_limiter_;
  ForceLimiter limiter_;
  std::array<StampedTip, kTips> tips_{};
  std::uint64_t tips_seen_ = 0;
};

}  // namespace brachy
