#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/rigid_transform.h"

namespace brachy {

/// Where a stepper has a transrectal probe, from where it rests: along its axis (+ towards its tip), and turned
/// about it.
struct StepperPlace {
  double depth_mm = 0, rotation_deg = 0;
  bool operator==(const StepperPlace&) const = default;
};

/// A motorised stepper: it goes to a place at a limited speed.
/// Threads: one. Real-time: no allocation.
class Stepper {
 public:
  static constexpr double kSpeedMmPerS = 20, kSpeedDegPerS = 45;

  const StepperPlace& place() const { return place_; }
  /// Moves towards `target` for dt_s.
  void move(const StepperPlace& target, double dt_s) noexcept {
    place_.depth_mm = towards(place_.depth_mm, target.depth_mm, kSpeedMmPerS * dt_s);
    place_.rotation_deg = towards(place_.rotation_deg, target.rotation_deg, kSpeedDegPerS * dt_s);
  }
  /// The probe's pose X_WP there, where X_WR is its pose at rest.
  RigidTransform pose(const RigidTransform& X_WR) const noexcept {
    const double angle = place_.rotation_deg * std::numbers::pi / 180;
    RigidTransform X_RP;
    X_RP.R << std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1;
    X_RP.p = Vec3(0, 0, place_.depth_mm);
    return X_WR * X_RP;
  }

 private:
  static double towards(double from, double to, double most) noexcept {
    return from + std::clamp(to - from, -most, most);
  }
  StepperPlace place_;
};

}  // namespace brachy
