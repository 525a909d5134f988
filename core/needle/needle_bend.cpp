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
    : guide_z_(guide_z_mm) {
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
  if (!guide_z_ || X_WN.R(2, 2) == 0) return;
  const double guide = beam_.length_mm - (X_WN.p.z() - *guide_z_) / X_WN.R(2, 2);
  if (guide > kLeastArc && guide < beam_.length_mm - kLeastArc) beam_.guide_mm = guide;
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
  for (const Load& load : loads_) sum += beam_.slope_compliance(s, load.arc_mm) * load.force_n;
  return across(sum);
}

// Where it is steepest unless it winds: at the tip, at the entry into the tissue or at the guide.
bool NeedleBend::is_steep() const noexcept {
  const auto steep_at = [&](double s) { return slope(s).squaredNorm() > kSteepest * kSteepest; };
  return steep_at(beam_.length_mm) || (beam_.guide_mm > 0 && steep_at(beam_.guide_mm)) ||
         (!loads_.empty() && steep_at(loads_.front().arc_mm));
}

Vec3 NeedleBend::guide_force_n() const noexcept {
  Vec3 sum = beam_.guide_share(beam_.length_mm) * tip_force_n_;
  for (const Load& load : loads_) sum += beam_.guide_share(load.arc_mm) * load.force_n;
  return -sum;
}

}  // namespace brachy
