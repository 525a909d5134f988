#pragma once

#include <cmath>

#include "core/needle/needle_forces.h"
#include "net/wire/fields.h"

/// Fields that FORCE, LOCAL_MODEL and FRAME's section FORCE share.
namespace brachy::net {

/// Forces are rendered by a motor: a reader refuses a number that is not finite.
void finite_force(auto& archive, auto&& value) {
  archive.f64(value);
  archive.check(std::isfinite(value), "a force, a place or a limit is not finite");
}

void finite_vec3(auto& archive, auto& v) {
  for (int axis = 0; axis < 3; ++axis) finite_force(archive, v(axis));
}

/// 13 f64.
void needle_forces_fields(auto& archive, MaybeConst<NeedleForces> auto& forces) {
  finite_vec3(archive, forces.force_n);
  finite_vec3(archive, forces.tip_torque_nmm);
  finite_vec3(archive, forces.hub_torque_nmm);
  finite_force(archive, forces.axial_n);
  finite_force(archive, forces.lateral_n);
  finite_force(archive, forces.cutting_n);
  finite_force(archive, forces.friction_n);
}

}  // namespace brachy::net
