#pragma once

#include <cstdint>

#include "core/base/rigid_transform.h"

namespace brachy {

/// One pose of a needle as a device sent it. X_WN: needle frame N (origin = tip, +z along the shaft towards the
/// tip) in the world frame W (patient RAS), mm.
struct NeedlePose {
  RigidTransform X_WN;
  std::uint64_t sequence = 0;    ///< the device's own count; echoed to clients
  std::int64_t stamp_ns = 0;     ///< the device's monotonic clock when the pose was taken; echoed to clients
  std::int64_t received_ns = 0;  ///< this process's monotonic clock when it arrived
  bool button = false;           ///< the device's button is held: it drops seeds (core/brachytherapy/seeds)
  std::uint32_t load_number =
      0;                   ///< counts an operator's requests to load this needle; a new one is carried out
  std::int32_t load = -1;  ///< of the last: the plan's needle whose train it carries now
  bool present = false;    ///< false until a device has sent a pose: no needle, no contact
};

}  // namespace brachy
