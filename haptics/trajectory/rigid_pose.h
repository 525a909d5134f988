#pragma once

#include "core/base/rigid_transform.h"

namespace brachy {

/// What a pose from outside the program, a trajectory file or a device, must fulfil.
inline constexpr double kRigidTolerance = 1e-3;  ///< max |RᵀR − I| accepted as a rotation
inline constexpr double kExactRotation = 1e-9;   ///< max |RᵀR − I| up to which a pose is used bit for bit
/// mm, |x|, |y|, |z| of the tip: beyond 10 m the units are wrong
inline constexpr double kMaxTipOffset = 1e4;

enum class PoseDefect {
  kNone,
  kNotFinite,   ///< NaN or infinity
  kOutOfRange,  ///< tip beyond kMaxTipOffset
  kNotRigid,    ///< not a rotation within kRigidTolerance, or left-handed
};

/// The first defect of X, in the order of the enum. Safe for any bits.
PoseDefect find_defect(const RigidTransform& X);

/// Replaces the rotation by the nearest one if its error is above kExactRotation; a transform within it is
/// left bitwise as it is, so that recorded poses replay exactly.
/// X's rotation is within kRigidTolerance.
void make_rigid(RigidTransform& X);

}  // namespace brachy
