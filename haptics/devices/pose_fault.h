#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace brachy {

/// What is wrong with the poses that a device sends. Bits of it: fault_bit().
enum class PoseFault : std::uint8_t {
  kNotFinite,        ///< NaN or infinity
  kFar,              ///< beyond 10 m
  kNotRigid,         ///< no rotation
  kLate,             ///< older than the others by PoseGuardSettings::stale_ns
  kDoubled,          ///< stamped as the one before
  kReordered,        ///< stamped before the one before
  kMetres,           ///< m for mm
  kQuaternionOrder,  ///< x, y, z, w for w, x, y, z, or the other way round
  kClockSet,         ///< their clock was set back, or ahead by PoseGuardSettings::clock_step_ns
  kUnseen,           ///< the tracker marks them as those of a tool that it does not see
  kForeign,          ///< of a needle or tool that is not the device's
  kTooMany,          ///< more than max_poses_per_s
};
inline constexpr std::size_t kPoseFaults = 12;

constexpr std::uint32_t fault_bit(PoseFault fault) {
  return 1u << static_cast<unsigned>(fault);
}

/// For the operator: the kind of poses, what is done with them, and what to look at.
std::string_view to_string(PoseFault fault);

}  // namespace brachy
