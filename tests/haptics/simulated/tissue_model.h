#pragma once

#include <algorithm>

#include "core/needle/local_contact_model.h"
#include "core/needle/needle_pose.h"

namespace brachy::test {

/// A tissue along +z for closed loops, as a LocalContactModel: a capsule at z = 0 that is punctured at 2 N, then
/// friction that grows with the depth, and cutting; a lateral spring about x = y = 0. Sampled at its ticks, as the
/// simulation is.
class TissueModel {
 public:
  double stiffness_n_per_mm = 0.8, puncture_n = 2, cutting_n = 0.6, friction_n_per_mm = 0.05;

  LocalContactModel operator()(const NeedlePose& pose) {
    LocalContactModel m;
    if (!pose.present) return m;
    const Vec3& tip = pose.X_WN.p;
    m.tick = ++tick_;
    m.reference_tip = tip;
    m.axial_stiffness_n_per_mm = stiffness_n_per_mm;
    if (!inside_) {
      m.is_capsule = true;
      m.in_contact = tip.z() > 0;
      m.axial_max_n = puncture_n;
      m.after_puncture_n = cutting_n;
      m.contact_point = Vec3(tip.x(), tip.y(), 0);
      if (stiffness_n_per_mm * tip.z() <= puncture_n) return m;
      inside_ = true;
      contact_z_ = tip.z() - cutting_n / stiffness_n_per_mm;
    }
    if (tip.z() < 0) {
      inside_ = false;
      return LocalContactModel{.tick = tick_};
    }
    const double friction = friction_n_per_mm * tip.z();
    m.is_capsule = false;
    m.in_contact = true;
    m.axial_min_n = -friction;
    m.axial_max_n = friction + cutting_n;
    contact_z_ = tip.z() - std::clamp(tip.z() - contact_z_, m.axial_min_n / stiffness_n_per_mm,
                                      m.axial_max_n / stiffness_n_per_mm);
    m.is_stuck = stiffness_n_per_mm * (tip.z() - contact_z_) < m.axial_max_n;
    m.contact_point = Vec3(tip.x(), tip.y(), contact_z_);
    m.lateral_stiffness_n_per_mm = 0.5;
    m.lateral_n = -0.5 * Vec3(tip.x(), tip.y(), 0);
    return m;
  }

  bool inside() const { return inside_; }

 private:
  std::uint64_t tick_ = 0;
  bool inside_ = false;
  double contact_z_ = 0;
};

}  // namespace brachy::test
