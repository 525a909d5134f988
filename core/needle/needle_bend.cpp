#include "core/needle/needle_bend.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

constexpr double kArcsPerMm = 1024;  // what sticks stays at its arc length to the last bit
constexpr double kLeastArc = 1;      // mm from the hub or the tip within which no guide holds

}  // namespace

NeedleBend::NeedleBend(const NeedleSettings& needle, std::optional<double> guide_z_mm,
                       std::size_t max_landmarks)
    : guide_z_(guide_z_mm), goes_with_hand_(needle.guide_at == NeedleSettings::kGuideInHand) {
  loads_.reserve(max_landmarks);
  beam_.length_mm = needle.length_mm;
  beam_.bending_stiffness_nmm2 =
      Beam::bending_stiffness(needle.youngs_modulus_gpa, needle.diameter_mm, needle.inner_diameter_mm);
  if (needle.hand_nmm_per_deg > 0) beam_.hand_rad_per_nmm = std::numbers::pi / 180 / needle.hand_nmm_per_deg;
  if (needle.bevel_force_share > 0) {
    const double angle = needle.bevel_deg * std::numbers::pi / 180;
    bevel_cos_ = std::cos(angle);
    bevel_sin_ = std::sin(angle);
  }
}

void NeedleBend::begin(const RigidTransform& X_BN, const RigidTransform& X_WN) noexcept {
  beam_.axis = X_BN.R.col(2);
  tip_ = X_BN.p;
  bevel_direction_ = bevel_cos_ * X_BN.R.col(0) + bevel_sin_ * X_BN.R.col(1);
  beam_.guide_mm = 0;
  offset_.setZero();
  if (guide_z_) find_hole(X_BN, X_WN);
}

// A fixed hole is where the needle first passed the plane, until it is drawn back through it.
void NeedleBend::find_hole(const RigidTransform& X_BN, const RigidTransform& X_WN) noexcept {
  const auto holds = [&](double arc) { return arc > kLeastArc && arc < beam_.length_mm - kLeastArc; };
  const double beyond = X_WN.R(2, 2) == 0 ? 0 : (X_WN.p.z() - *guide_z_) / X_WN.R(2, 2);  // of the tip
  if (!holds(beam_.length_mm - beyond)) {
    hole_.reset();
    return;
  }
  if (goes_with_hand_) {
    beam_.guide_mm = beam_.length_mm - beyond;
    return;
  }
  if (!hole_) hole_ = X_WN.p - beyond * X_WN.R.col(2);
  const Vec3 p_N = X_WN.R.transpose() * (*hole_ - X_WN.p);
  if (!holds(beam_.length_mm + p_N.z())) return;
  beam_.guide_mm = beam_.length_mm + p_N.z();
  offset_ = X_BN.R.leftCols<2>() * p_N.head<2>();
}

void NeedleBend::set_loads(std::span<const NeedleLandmark> landmarks) noexcept {
  loads_.clear();
  for (const NeedleLandmark& landmark : landmarks)
    loads_.push_back({landmark.arc_mm, across(-landmark.reaction_n)});
}

void NeedleBend::clear() noexcept {
  loads_.clear();
  tip_force_n_.setZero();
}

double NeedleBend::arc_of(const Vec3& x) const noexcept {
  const double arc = beam_.length_mm - (tip_ - x).dot(beam_.axis);
  return std::clamp(std::round(kArcsPerMm * arc) / kArcsPerMm, 0.0, beam_.length_mm);
}

Vec3 NeedleBend::deflection(double s) const noexcept {
  Vec3 sum = free_deflection(s);
  for (const Load& load : loads_) sum += beam_.compliance(s, load.arc_mm) * load.force_n;
  return across(sum);
}

Vec3 NeedleBend::slope(double s) const noexcept {
  Vec3 sum = beam_.slope_compliance(s, beam_.length_mm) * tip_force_n_;
  if (is_held_aside()) sum += beam_.guide_slope(s) * offset_;
  for (const Load& load : loads_) sum += beam_.slope_compliance(s, load.arc_mm) * load.force_n;
  return across(sum);
}

// Where it is steepest unless it winds: at the tip, at the entry into the tissue or at the guide.
bool NeedleBend::is_steep() const noexcept {
  const auto steep_at = [&](double s) { return slope(s).squaredNorm() > kSteepest * kSteepest; };
  return steep_at(beam_.length_mm) || (beam_.guide_mm > 0 && steep_at(beam_.guide_mm)) ||
         (!loads_.empty() && steep_at(loads_.front().arc_mm));
}

// The hole's force is normal to the bent needle: the part along the needle is what moving the hole along it would take
// of the energy that the needle stores.
Vec3 NeedleBend::guide_force_n() const noexcept {
  if (!is_guided()) return Vec3::Zero();
  Vec3 force = stiffness_at_hole() * offset_ - beam_.guide_share(beam_.length_mm) * tip_force_n_;
  for (const Load& load : loads_) force -= beam_.guide_share(load.arc_mm) * load.force_n;
  const Vec3 along = -force.dot(slope(beam_.guide_mm)) * beam_.axis;
  return goes_with_hand_ ? along : Vec3(force + along);
}

}  // namespace brachy
