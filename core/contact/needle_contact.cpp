#include "core/contact/needle_contact.h"

#include <algorithm>
#include <array>

namespace brachy {
namespace {

constexpr double kInsideMargin = 1e-3;  // mm: the end of a path through the far side is kept this far inside
constexpr std::size_t kMaxCrossings = 32;  // of one needle with one surface; a folded organ has a handful
constexpr double kPathSlack = 4;           // a path may wind: room for this many needle lengths

}  // namespace

NeedleContact::NeedleContact(const SurfaceBvh& surface, const NeedleSettings& needle,
                             const ContactSettings& settings)
    : surface_(surface), needle_settings_(needle), settings_(settings), path_(kPathSlack * needle.length_mm) {
  const auto capacity = static_cast<std::size_t>(settings.max_landmarks);
  shaft_.reserve(capacity);
  positions_.reserve(capacity);
  displacements_.reserve(capacity);
}

void NeedleContact::update(const RigidTransform& X_WN, const TissueField* last_field) noexcept {
  const Vec3 axis = X_WN.R.col(2);
  const Needle needle{X_WN.p - needle_settings_.length_mm * axis, X_WN.p, axis};
  const Vec3 motion = needle.tip - last_tip_;
  flags_ = 0;

  if (!has_last_pose_ || motion.norm() > settings_.max_jump_mm) {
    seat(needle);
  } else if (state_ == ContactState::kFree || state_ == ContactState::kWithdrawn) {
    approach(needle);
  } else if (state_ == ContactState::kTouching) {
    press(needle);
  } else {
    move_tip(needle);
    move_shaft(needle, motion.dot(axis), last_field);
  }

  collect(needle);
  last_tip_ = needle.tip;
  has_last_pose_ = true;
}

// The needle stands where it stands, without having dragged anything.
void NeedleContact::seat(const Needle& needle) noexcept {
  if (has_last_pose_) flags_ |= kStepReseated;
  release();
  std::array<SurfaceHit, kMaxCrossings> buffer;
  const std::span hits(buffer.data(), surface_.all_hits(needle.hub, needle.tip, buffer));
  const bool inside = surface_.inside(needle.tip);
  Vec3 entry = needle.hub, exit = needle.tip;
  bool entered = false, left = false;
  for (const SurfaceHit& hit : hits) {
    if (hit.entering) {
      entry = hit.point;
      entered = true;
      left = false;
    } else {
      exit = hit.point - kInsideMargin * needle.axis;
      left = true;
    }
  }
  if (!inside && !(entered && left)) return;

  state_ = inside ? ContactState::kInserted : ContactState::kThrough;
  was_inserted_ = true;
  path_.start(entry);
  path_.extend_to(inside ? needle.tip : exit);
  tip_s_ = path_.length();
  move_shaft(needle, 0, nullptr);
}

void NeedleContact::approach(const Needle& needle) noexcept {
  if (const auto hit = surface_.first_hit(last_tip_, needle.tip); hit && hit->entering) {
    contact_point_ = hit->point;
    contact_normal_ = hit->normal;
    by_tip_ = true;
  } else if (surface_.inside(needle.tip)) {
    return seat(needle);
  } else {
    std::array<SurfaceHit, 2> hits;
    if (surface_.all_hits(needle.hub, needle.tip, hits) < 2) return;
    const ClosestPoint nearest = surface_.closest_point(0.5 * (hits[0].point + hits[1].point));
    contact_point_ = nearest.point;
    contact_normal_ = nearest.normal;
    by_tip_ = false;
  }
  state_ = ContactState::kTouching;
  press(needle);
}

void NeedleContact::press(const Needle& needle) noexcept {
  const bool tip_inside = surface_.inside(needle.tip);
  if (!tip_inside && !surface_.first_hit(needle.hub, needle.tip)) return release();

  const double off_axis = (needle.nearest_on_line(contact_point_) - contact_point_).norm();
  if (tip_inside) by_tip_ = true;
  if (!tip_inside && off_axis > settings_.surface_slip_mm) by_tip_ = false;

  if (by_tip_ && (needle.tip - contact_point_).dot(needle.axis) >= settings_.puncture_indentation_mm)
    return puncture(needle);

  // The contact point slides over the capsule once it has been dragged too far along it.
  const Vec3 target = by_tip_ ? needle.tip : needle.nearest_on_line(contact_point_);
  const Vec3 d = target - contact_point_;
  const Vec3 drag = d - d.dot(contact_normal_) * contact_normal_;
  if (const double length = drag.norm(); length > settings_.surface_slip_mm) {
    const ClosestPoint slid =
        surface_.closest_point(contact_point_ + (1 - settings_.surface_slip_mm / length) * drag);
    contact_point_ = slid.point;
    contact_normal_ = slid.normal;
  }
}

void NeedleContact::puncture(const Needle& needle) noexcept {
  state_ = ContactState::kInserted;
  was_inserted_ = true;
  ++puncture_count_;
  path_.start(contact_point_);
  tip_s_ = 0;
  move_tip(needle);
}

// The tip's landmark is carried along while the push stays in [0, cutting]; beyond it the material point slips, at
// no push along what is already cut, and by cutting at its end. A tip cannot pull.
void NeedleContact::move_tip(const Needle& needle) noexcept {
  if (state_ == ContactState::kThrough) {
    if ((needle.tip - path_.at(path_.length())).dot(needle.axis) > 0) return;
    state_ = ContactState::kInserted;
    tip_s_ = path_.length();
  }
  const double push = (needle.tip - path_.at(tip_s_)).dot(needle.axis);
  if (push < 0) {
    tip_s_ = std::max(0.0, tip_s_ + push);
    if (tip_s_ == 0 && !surface_.inside(needle.tip)) release();
    return;
  }
  if (tip_s_ < path_.length()) tip_s_ = std::min(tip_s_ + push, path_.length());
  if (tip_s_ < path_.length()) return;
  const double rest = (needle.tip - path_.at(tip_s_)).dot(needle.axis);
  if (rest > settings_.cutting_displacement_mm) cut(needle, rest - settings_.cutting_displacement_mm);
}

void NeedleContact::cut(const Needle& needle, double distance) noexcept {
  const Vec3 from = path_.at(path_.length());
  const Vec3 to = from + distance * needle.axis;
  // A cut from the entry starts on the surface and may see itself enter: the first crossing outwards counts.
  std::array<SurfaceHit, 4> buffer;
  const std::span hits(buffer.data(), surface_.all_hits(from, to, buffer));
  const auto exit =
      std::find_if(hits.begin(), hits.end(), [](const SurfaceHit& hit) { return !hit.entering; });
  if (exit != hits.end()) {
    path_.extend_to(exit->point - kInsideMargin * needle.axis);
    state_ = ContactState::kThrough;
  } else {
    path_.extend_to(to);
  }
  tip_s_ = path_.length();
}

// Shaft landmarks stand on the cut path every spacing, from the entry on. One is set when the tip is half a spacing
// past it and taken up at a quarter, so that it never comes near the tip's own landmark and does not flicker.
void NeedleContact::move_shaft(const Needle& needle, double axial_motion,
                               const TissueField* last_field) noexcept {
  const double friction = settings_.friction_displacement_mm, spacing = settings_.landmark_spacing_mm;
  if (state_ != ContactState::kInserted && state_ != ContactState::kThrough) return;
  for (ShaftLandmark& landmark : shaft_)
    landmark.axial = std::clamp(landmark.axial + axial_motion, -friction, friction);

  const auto s_of_last = [&] { return spacing * (static_cast<double>(shaft_.size()) - 1); };
  while (!shaft_.empty() && tip_s_ < s_of_last() + 0.25 * spacing) shaft_.pop_back();
  while (tip_s_ >= s_of_last() + 1.5 * spacing &&
         shaft_.size() + 1 < static_cast<std::size_t>(settings_.max_landmarks)) {
    const Vec3 X = path_.at(s_of_last() + spacing);
    const double carried = last_field ? last_field->displacement_at(X).dot(needle.axis) : 0;
    shaft_.push_back({X, std::clamp(carried, -friction, friction)});
  }
}

void NeedleContact::release() noexcept {
  state_ = was_inserted_ ? ContactState::kWithdrawn : ContactState::kFree;
  shaft_.clear();
  tip_s_ = 0;
}

void NeedleContact::collect(const Needle& needle) noexcept {
  positions_.clear();
  displacements_.clear();
  insertion_depth_ = 0;
  if (state_ == ContactState::kTouching) {
    const Vec3 target = by_tip_ ? needle.tip : needle.nearest_on_line(contact_point_);
    add_landmark(contact_point_, target - contact_point_);
  } else if (state_ == ContactState::kInserted || state_ == ContactState::kThrough) {
    const Vec3 X_tip = path_.at(tip_s_);
    insertion_depth_ = tip_s_;
    for (const ShaftLandmark& landmark : shaft_) {
      const Vec3 lateral = needle.nearest_on_line(landmark.position) - landmark.position;
      add_landmark(landmark.position, lateral + landmark.axial * needle.axis);
    }
    // In order along the shaft; and the tip, which moves most, last: the landmark systems then renew its rows only.
    if (state_ == ContactState::kInserted) add_landmark(X_tip, needle.tip - X_tip);
  }
}

void NeedleContact::add_landmark(const Vec3& position, const Vec3& displacement) noexcept {
  const double length = displacement.norm();
  positions_.push_back(position);
  if (length > settings_.max_displacement_mm) {
    flags_ |= kStepSaturated;
    displacements_.push_back(settings_.max_displacement_mm / length * displacement);
  } else {
    displacements_.push_back(displacement);
  }
}

double NeedleContact::load() const noexcept {
  double largest = 0;
  for (const Vec3& d : displacements_) largest = std::max(largest, d.norm());
  return std::min(1.0, largest / settings_.puncture_indentation_mm);
}

}  // namespace brachy
