#pragma once

#include <Eigen/Core>

#include "core/base/rigid_transform.h"

namespace brachy {

/// A haptic device with a needle in its handle, and the hand that holds it. The defaults are those of a Touch
/// (45 g at its tip) with a needle and a handle, in a loose grip.
struct DeviceDynamicsSettings {
  double mass_kg = 0.1;  ///< effective at the tip, in every direction; 0.001 … 10
  /// physical damping of the device's joints, on which passivity depends; ≥ 0
  double damping_n_s_per_mm = 0.0005;
  /// of the grip, between hand and handle; 0 and no hand damping: no hand
  double hand_stiffness_n_per_mm = 0.3;
  double hand_damping_n_s_per_mm = 0.005;  ///< ≥ 0
  double rate_hz = 1000;                   ///< of its cycle: pose read, force applied; 50 … 20,000
  double encoder_mm = 0.02;                ///< step of the positions it reads; 0: none
};

/// The motion of that device in three directions alike: m x″ = −b x′ + k_h (h − x) + b_h (h′ − x′) + F, with
/// the force F held and the hand h moving evenly during each cycle. Each cycle is integrated exactly (the
/// exponential of the linear system), so that energy is gained or lost by the loop and not by the integrator.
/// Orientation is not modelled: it follows the hand. mm, s, N.
///
/// Threads: one. Real-time: advance does not allocate.
class DeviceDynamics {
 public:
  /// At rest with tip and hand at `start`. Settings are within the ranges above.
  DeviceDynamics(const DeviceDynamicsSettings& settings, const Vec3& start);

  /// Advances by one cycle with `force_n` on the needle; at its end the hand is at `hand`.
  void advance(const Vec3& force_n, const Vec3& hand);

  /// Moves the tip to `tip`, at rest.
  void displace(const Vec3& tip);

  Vec3 tip() const { return state_.row(0); }       ///< true position
  Vec3 velocity() const { return state_.row(1); }  ///< mm/s
  Vec3 measured_tip() const;                       ///< as read by the encoders
  Vec3 hand() const { return state_.row(2); }

 private:
  double encoder_mm_, period_s_;
  Eigen::Matrix<double, 5, 5> transition_;  // of (x, x′, h, h′, F) over one cycle
  Eigen::Matrix<double, 5, 3> state_;       // the same for the three directions
};

}  // namespace brachy
