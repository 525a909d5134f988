#pragma once

#include <limits>
#include <optional>
#include <string>

#include "core/base/rigid_transform.h"

namespace brachy {

/// What an adapter says about its device; the daemon negotiates with it (haptics/force/negotiation.h).
struct HandDeviceFacts {
  std::string name;                    ///< the daemon shows it
  double max_force_n = 0;              ///< that it renders; 0: it renders none
  double damping_n_s_per_mm = 0.0005;  ///< of its own mechanics
  double rate_hz = 1000;               ///< of exchange()
};

/// Where the hand is, in the device's frame D.
struct HandReading {
  /// The needle's tip as the hand holds it, mm. Not finite: not known now, as where the device was unplugged; then no
  /// force is rendered and the needle stays.
  Vec3 p_DN = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  /// The needle's axes as the hand holds it, +z along the shaft towards the tip. None: the device has three axes, and
  /// the needle points along the world's +z.
  std::optional<Mat3> R_DN;
  bool button = false;  ///< held: it drops seeds
};

/// R_WD of a device: `right` and `up` are the directions in D, as the device's user sees them who looks into the
/// screen, unit vectors. The viewer and the ultrasound image look at the patient from the feet, as the physician does
/// who holds the needle: screen right is the patient's left (−x of W), up is anterior (+y), into the screen is along
/// the needle, towards the head (+z).
inline Mat3 device_in_world(const Vec3& right, const Vec3& up) {
  const Vec3 into = up.cross(right);
  return -Vec3::UnitX() * right.transpose() + Vec3::UnitY() * up.transpose() +
         Vec3::UnitZ() * into.transpose();
}

/// The seam between a device's driver and brachyd: an adapter is one class with these two calls, and
/// run_hand_adapter (apps/examples/hand_adapter.h) does all else: connection, poses, force, safety.
///
/// D is whatever frame the driver has; HandLoop maps it into the world. Forces are given in D too.
/// Threads: one. exchange() may block for a cycle, not longer.
class HandDevice {
 public:
  virtual ~HandDevice() = default;
  virtual HandDeviceFacts facts() const = 0;
  /// One cycle: renders `force_n` (on the hand, D, N; finite, within the limits) and reads where the hand is. A device
  /// that does not answer for a while leaves `reading.p_DN` as it comes, which is not finite. False: the device is gone
  /// for good; it has been told 0 N as far as it still listens.
  virtual bool exchange(const Vec3& force_n, HandReading& reading) = 0;
};

}  // namespace brachy
