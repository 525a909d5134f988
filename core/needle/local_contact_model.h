#pragma once

#include <cstdint>

#include "core/base/rigid_transform.h"

namespace brachy {

/// One needle's contact around one pose, small enough to be sent every tick. From it the computer at the device
/// computes the force at 1 kHz or more without another request (haptics/force/local_force.h): the stiff loop never
/// closes over a network. World frame W, mm, N.
///
/// Along the shaft, z = (tip − contact_point)·axis, axial force axial_n > 0 pushes the needle out:
///
///     axial_n = clamp(axial_stiffness z, axial_min_n, axial_max_n)
///
/// Beyond a limit the tissue slips: contact_point goes along, so that the force stays at the limit and falls
/// at once when the needle turns (Karnopp's stick and slip). Where axial_min_n is 0 the tissue only pushes,
/// and contact_point stays when the needle leaves. Where is_capsule is set, reaching axial_max_n punctures:
/// from then on after_puncture_n limits.
/// Besides, while there is contact: lateral_n − lateral_stiffness (tip − reference_tip)_⊥.
struct LocalContactModel {
  std::uint64_t tick = 0;               ///< that it belongs to; 0: none
  bool in_contact = false;              ///< false: no force; contact_point may describe a capsule ahead
  bool is_capsule = false;              ///< axial_max_n is a puncture force
  bool is_stuck = true;                 ///< the tissue goes along with the needle; false: it slips
  Vec3 reference_tip = Vec3::Zero();    ///< the tip for which this was computed
  Vec3 contact_point = Vec3::Zero();    ///< on the needle's line: where the axial force is 0
  Vec3 axis = Vec3::UnitZ();            ///< unit, along the shaft towards the tip
  double axial_stiffness_n_per_mm = 0;  ///< of tissue that sticks
  double axial_min_n = 0;               ///< ≤ 0: minus the friction bound
  double axial_max_n = 0;               ///< friction bound and cutting force, or puncture force
  double after_puncture_n = 0;          ///< axial_max_n once the capsule is through
  /// on the needle at reference_tip, across the axis; and what a template's hole and the tissue beside do along it to a
  /// bent needle
  Vec3 lateral_n = Vec3::Zero();
  double lateral_stiffness_n_per_mm = 0;
  double time_to_live_s = 0.05;  ///< from arrival on; then the force goes to 0

  bool operator==(const LocalContactModel&) const = default;
};

}  // namespace brachy
