#pragma once

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
  RigidTransform X_DN;  ///< of the needle's frame as the hand holds it, mm
  bool button = false;  ///< held: it drops seeds
};

/// The seam between a device's driver and brachyd: an adapter is one class with these two calls, and
/// run_hand_adapter (apps/examples/hand_adapter.h) does all else: connection, poses, force, safety.
///
/// D is whatever frame the driver has; HandLoop maps it into the world. Forces are given in D too.
/// Threads: one. exchange() may block for a cycle, not longer.
class HandDevice {
 public:
  virtual ~HandDevice() = default;
  virtual HandDeviceFacts facts() const = 0;
  /// One cycle: renders `force_n` (on the hand, D, N; finite, within the limits) and reads where the hand is. False:
  /// the device is gone or answers no more; it has been told 0 N as far as it still listens.
  virtual bool exchange(const Vec3& force_n, HandReading& reading) = 0;
};

}  // namespace brachy
