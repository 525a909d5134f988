#include "core/needle/probe_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/models/step_flag.h"

namespace brachy {
namespace {

constexpr double kLookAround = 3;  // mm around the probe within which a point's displacement is asked for
constexpr double kLetGo = 0.5;     // mm off the probe at which a point is no landmark any more
constexpr double kSameNormal =
    5e-5;  // 1 − cosine of the 0.6° by which a normal may be off: 0.05 mm at 5 mm aside
constexpr double kNearAxis = 0.25;  // radii from the axis within which the normal is not the point's own
// Core radius of a landmark's force over the spacing. Wider ones push beyond the rim of the contact (1: 27 % more force
// than finite elements), narrower ones let the gland through between landmarks (tests/reference/gland).
constexpr double kCorePerSpacing = 0.65;

}  // namespace

ProbeContact::ProbeContact(const SurfaceMesh& surface, const ProbeSettings& probe,
                           const ContactSettings& contact)
    : probe_(probe), max_displacement_(contact.max_displacement_mm) {
  const double apart = probe.landmark_spacing_mm * probe.landmark_spacing_mm;
  for (const Vec3& X : surface.vertices) {
    centre_ += X / static_cast<double>(surface.vertices.size());
    const bool is_far = std::ranges::none_of(
        points_, [&](const Point& point) { return (point.position - X).squaredNorm() < apart; });
    if (is_far) points_.push_back({.position = X});
  }
  landmarks_.reserve(ProbeSettings::kMaxLandmarks);
  touching_.reserve(ProbeSettings::kMaxLandmarks);
}

// The round tip's centre is a radius behind the tip.
Vec3 ProbeContact::nearest_on_axis(const Vec3& p) const noexcept {
  const double along = (p - pose_.tip).dot(pose_.axis);
  return pose_.tip + std::clamp(along, -probe_.length_mm, -0.5 * probe_.diameter_mm) * pose_.axis;
}

void ProbeContact::begin(const RigidTransform& X_WP, const DisplacementField& last_field,
                         const BodyFrame& frame) noexcept {
  const RigidTransform X_BP = frame.from_world(X_WP);
  pose_.tip = X_BP.p;
  pose_.axis = X_BP.R.col(2);
  pose_.world_tip = X_WP.p;
  pose_.turn = X_WP.R * X_BP.R.transpose();
  flags_ = 0;
  landmarks_.clear();
  touching_.clear();
  for (std::size_t i = 0; i < points_.size(); ++i) update(i, last_field);
  direction_ = Vec3::Zero();
  for (const NeedleLandmark& landmark : landmarks_) direction_ += landmark.axis;
  direction_ = direction_.norm() > 0 ? Vec3(direction_.normalized()) : Vec3(pose_.axis.unitOrthogonal());
}

void ProbeContact::update(std::size_t i, const DisplacementField& last_field) noexcept {
  Point& point = points_[i];
  const double radius = 0.5 * probe_.diameter_mm + probe_.rectal_wall_mm;
  const bool was_touching = point.normal != Vec3::Zero();
  const auto let_go = [&] { point = {.position = point.position}; };
  if (!was_touching && (point.position - nearest_on_axis(point.position)).norm() > radius + kLookAround)
    return let_go();
  const Vec3 u = last_field.displacement_at(point.position), x = point.position + u;
  const Vec3 on_axis = nearest_on_axis(x), from_axis = x - on_axis;
  const double distance = from_axis.norm();
  if (distance > radius && (!was_touching || (point.pressed_n <= 0 && distance > radius + kLetGo)))
    return let_go();
  if (landmarks_.size() == ProbeSettings::kMaxLandmarks) {
    flags_ |= kStepDropped;
    return let_go();
  }
  Vec3 normal = distance > kNearAxis * radius ? Vec3(from_axis / distance) : Vec3(centre_ - on_axis);
  normal.normalize();
  // A normal that changes a little makes another system of landmarks.
  if (1 - normal.dot(point.normal) > kSameNormal) point.normal = normal;

  double depth = radius - point.normal.dot(point.position - on_axis);
  if (depth > max_displacement_) {
    depth = max_displacement_;
    flags_ |= kStepSaturated;
  }
  NeedleLandmark landmark;
  landmark.position = point.position;
  landmark.axis = point.normal;
  landmark.slides = true;
  landmark.if_stuck = depth * point.normal + (u - u.dot(point.normal) * point.normal);
  landmark.high_n = std::numeric_limits<double>::infinity();
  landmark.spread.core_mm = kCorePerSpacing * probe_.landmark_spacing_mm;
  landmarks_.push_back(landmark);
  touching_.push_back(i);
}

void ProbeContact::skip() noexcept {
  landmarks_.clear();
  touching_.clear();
  for (Point& point : points_) point = {.position = point.position};
  flags_ = 0;
  indentation_ = 0;
  state_ = ContactState::kFree;
  forces_ = {};
  local_model_ = {};
}

void ProbeContact::finish(std::uint64_t tick, double stiffness_n_per_mm) noexcept {
  forces_ = {};
  indentation_ = 0;
  Vec3 on_gland = Vec3::Zero();
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const NeedleLandmark& landmark = landmarks_[i];
    const double pressed = landmark.reaction_n.dot(landmark.axis);
    points_[touching_[i]].pressed_n = pressed;
    on_gland += landmark.reaction_n;
    const Vec3 at = nearest_on_axis(landmark.position + landmark.if_stuck - landmark.body);
    forces_.tip_torque_nmm -= (at - pose_.tip).cross(landmark.reaction_n);
    if (pressed > 0) indentation_ = std::max(indentation_, landmark.if_stuck.dot(landmark.axis));
  }
  const double pushed = on_gland.norm();
  state_ = pushed > 0 ? ContactState::kTouching : ContactState::kFree;
  local_model_ = {};
  local_model_.tick = tick;
  local_model_.axis = pose_.turn * pose_.axis;
  local_model_.reference_tip = local_model_.contact_point = pose_.world_tip;
  if (pushed == 0) return;

  // The surroundings are pushed where the gland is.
  const double more = probe_.surroundings_n_per_mm * indentation_ / pushed;
  const Vec3 force = -(1 + more) * (pose_.turn * on_gland);
  forces_.force_n = force;
  forces_.tip_torque_nmm = (1 + more) * (pose_.turn * forces_.tip_torque_nmm);
  forces_.hub_torque_nmm =
      forces_.tip_torque_nmm + (probe_.length_mm * local_model_.axis).cross(forces_.force_n);
  forces_.axial_n = forces_.cutting_n = std::max(0.0, -force.dot(local_model_.axis));
  const Vec3 across = force - force.dot(local_model_.axis) * local_model_.axis;
  forces_.lateral_n = across.norm();

  local_model_.in_contact = true;
  local_model_.lateral_n = across;
  const double stiffness = stiffness_n_per_mm + probe_.surroundings_n_per_mm;
  local_model_.lateral_stiffness_n_per_mm = local_model_.axial_stiffness_n_per_mm = stiffness;
  local_model_.contact_point -= forces_.axial_n / stiffness * local_model_.axis;
  local_model_.axial_max_n = local_model_.after_puncture_n = 2 * forces_.axial_n;
}

}  // namespace brachy
