#include "core/brachytherapy/structures/bone_stop.h"

#include <algorithm>
#include <limits>

namespace brachy {
BoneStop::BoneStop(const std::vector<TestedOrgan>& organs, double stiffness_n_per_mm, double length_mm,
                   double max_jump_mm)
    : organs_(organs),
      stiffness_(stiffness_n_per_mm),
      length_(length_mm),
      max_jump_(max_jump_mm),
      has_bone_(std::ranges::any_of(organs, &TestedOrgan::is_bone)) {}

RigidTransform BoneStop::hold(RigidTransform X_WN, const Vec3& bend) noexcept {
  if (!has_bone_) return X_WN;
  axis_ = X_WN.R.col(2);
  const Vec3 tip = X_WN.p + bend;
  // The hand's own way: the held tip may lag far behind it.
  const bool comes_by_way = is_known_ && (tip - last_hand_tip_).norm() <= max_jump_;
  const double reach = comes_by_way ? std::min(length_, held_back_mm_ + max_jump_) : length_;
  double back = 0;
  for (const TestedOrgan& organ : organs_) {
    if (!organ.is_bone) continue;
    const bool comes =
        comes_by_way ? is_stopped() || organ.surface->first_hit(last_tip_, tip) : organ.surface->inside(tip);
    if (!comes) continue;
    const auto hit = organ.surface->first_hit(tip - reach * axis_, tip);
    if (hit && hit->entering) back = std::max(back, (tip - hit->point).dot(axis_) + kClearanceMm);
  }
  held_back_mm_ = back;
  X_WN.p -= back * axis_;
  last_tip_ = tip - back * axis_;
  last_hand_tip_ = tip;
  is_known_ = true;
  return X_WN;
}

void BoneStop::skip() noexcept {
  is_known_ = false;
  held_back_mm_ = 0;
}

double BoneStop::force_n() const noexcept {
  return std::min(stiffness_ * held_back_mm_, kLargestN);
}

void BoneStop::add_to(NeedleForces& forces, LocalContactModel& model) const noexcept {
  if (!is_stopped()) return;
  const double bone = force_n(), all = forces.axial_n + bone;
  forces.force_n -= bone * axis_;
  forces.cutting_n += bone;
  forces.axial_n = all;
  // As stiff as the bone about where the hand is, from the force of bone and tissue together on.
  model.in_contact = true;
  model.is_capsule = false;
  model.is_stuck = true;
  model.axis = axis_;
  model.reference_tip += held_back_mm_ * axis_;
  model.axial_stiffness_n_per_mm = std::max(model.axial_stiffness_n_per_mm, stiffness_);
  model.contact_point = model.reference_tip - all / model.axial_stiffness_n_per_mm * axis_;
  model.axial_min_n = std::min(model.axial_min_n, 0.0);
  model.axial_max_n = model.after_puncture_n = std::numeric_limits<double>::infinity();
}

}  // namespace brachy
