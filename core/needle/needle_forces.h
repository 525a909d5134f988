#pragma once

#include <cmath>

#include "core/base/rigid_transform.h"

namespace brachy {

/// What the hand that holds a needle feels in one tick; world frame W. On `elastic` and `fem` the tissue's part is
/// forces; on the other models the landmarks' weights at the elastic stiffness of one landmark
/// (core/elasticity/landmark_stiffness.h).
struct NeedleForces {
  Vec3 force_n = Vec3::Zero();  ///< on the needle: minus the sum of its landmarks' reactions, and guide_n, N
  Vec3 guide_n = Vec3::Zero();  ///< of that, what the template's hole does (NeedleBend::guide_force_n), N
  Vec3 tip_torque_nmm = Vec3::Zero();  ///< moment of force_n's parts about the tip, N·mm
  Vec3 hub_torque_nmm = Vec3::Zero();  ///< and about the hub
  double axial_n = 0;  ///< the tissue's, along the shaft; > 0 pushes the needle out. = cutting_n + friction_n
  double lateral_n = 0;   ///< the tissue's, size of the part across the shaft, ≥ 0
  double cutting_n = 0;   ///< of axial_n, what acts on the tip: capsule or cut, ≥ 0
  double friction_n = 0;  ///< of axial_n, what acts along the shaft: < 0 on the way out

  bool is_finite() const {
    return force_n.allFinite() && guide_n.allFinite() && tip_torque_nmm.allFinite() &&
           hub_torque_nmm.allFinite() && std::isfinite(axial_n) && std::isfinite(lateral_n) &&
           std::isfinite(cutting_n) && std::isfinite(friction_n);
  }
  bool operator==(const NeedleForces&) const = default;
};

}  // namespace brachy
