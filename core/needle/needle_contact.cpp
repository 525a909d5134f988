#include "core/needle/needle_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/models/landmark_set.h"
#include "core/models/step_flag.h"

namespace brachy {
namespace {

constexpr double kInsideMargin = 1e-3;  // mm: the end of a path through the far side is kept this far inside
constexpr std::size_t kMaxCrossings = 32;  // of one needle with one surface; a folded organ has a handful
constexpr double kPathSlack = 4;           // a path may wind: space for this many needle lengths
constexpr double kSameEntry = 1;  // needle diameters from an old entry within which it is the same hole
constexpr double kSameDirection = 0.94;  // cosine of the 20° within which a needle finds its old cut
// mm ahead of a free needle within which the capsule is reported to the device
constexpr double kLookAhead = 25;
constexpr double kMostOblique = 0.5;  // cosine: a tip slides no more on a capsule that is steeper
constexpr double kTipFriction = 0.3;  // of a tip on the capsule; an assumption
constexpr int kBisections = 20;       // of a tick's cut: a capsule is found to 1e-6 of it
// Cosine of a surface's normal to the needle up to which a tip that slides over it drags it, as its side would not.
constexpr double kFacing = -0.5;
constexpr double kNoForceN = 1e-9, kRounding = 1e-12;
constexpr double kPieceMm = 2.5;  // of a course, taken as straight where it crosses a surface
constexpr double kMostTurn =
    0.866;  // cosine of the 30° beyond which a needle that turns in a tick has jumped

}  // namespace

NeedleContact::NeedleContact(const SurfaceBvh& surface, const NeedleTissues& tissues,
                             const NeedleSettings& needle, const ContactSettings& settings,
                             std::optional<double> guide_z_mm, std::span<const Vec3> course)
    : surface_(surface),
      tissues_(tissues),
      needle_settings_(needle),
      settings_(settings),
      side_(surface, 0.5 * needle.diameter_mm, settings.max_displacement_mm),
      cut_{CutPath(kPathSlack * needle.length_mm)} {
  old_.paths.reserve(kOldPaths);  // a copy would not keep its capacity
  while (old_.paths.size() < kOldPaths) old_.paths.emplace_back(kPathSlack * needle.length_mm);
  const auto capacity = static_cast<std::size_t>(settings.max_landmarks);
  cut_.shaft.reserve(capacity);
  outcome_.landmarks.reserve(capacity);
  needle_.course = FollowedCourse(course);
  if (needle.bends() && course.empty()) bend_.emplace(needle, guide_z_mm, capacity);
}

void NeedleContact::begin(const RigidTransform& X_WN, const DisplacementField* last_field,
                          const BodyFrame& frame) noexcept {
  const RigidTransform X_BN = frame.from_world(X_WN);
  body_.is_moving = body_.is_turned || !frame.is_identity();
  body_.is_turned = !frame.is_identity();
  if (body_.is_turned) body_.turn = X_WN.R * X_BN.R.transpose();
  last_.tip = frame.from_world(last_.world_tip);
  last_.free_tip = last_.tip + (needle_.free_tip - needle_.tip);
  last_.world_tip = X_WN.p;
  const Vec3 axis = X_BN.R.col(2), last_axis = last_.world_axis;
  last_.world_axis = X_WN.R.col(2);
  const bool followed = needle_.course.is_followed();
  set_needle(X_WN, X_BN);
  const bool has_jumped = last_.is_known && ((X_BN.p - last_.tip).norm() > settings_.max_jump_mm ||
                                             last_axis.dot(last_.world_axis) < kMostTurn ||
                                             (is_in() && followed != needle_.course.is_followed()));
  needle_.moved =
      (X_BN.p - last_.tip).norm() + needle_settings_.length_mm * (last_.world_axis - last_axis).norm();
  if (bend_) {
    if (has_jumped) bend_->leave_hole();
    bend_->begin(X_BN, X_WN);
    needle_.bent_tip += bend_->tip_deflection();
    lay_free_line();
    last_.slope = bend_->tip_slope();
  }
  const Vec3 motion = needle_.tip - last_.tip;
  outcome_.flags = 0;
  outcome_.landmarks.clear();
  outcome_.has_tip_landmark = false;
  cut_.free_slip = 0;
  outcome_.insertion_depth = 0;

  bool is_reinitialized = false;
  if (!last_.is_known || has_jumped) {
    reinitialize();
    is_reinitialized = true;
  } else if (state_ == ContactState::kFree || state_ == ContactState::kWithdrawn) {
    approach();
  } else if (state_ == ContactState::kTouching) {
    press_.by_tip ? press() : press_beside();
  } else {
    follow_path(last_field);
  }
  last_.is_known = true;

  outcome_.tip_depth = std::max(0.0, depth_of_tip());
  if (bend_) set_tip_force();
  if (state_ == ContactState::kTouching) add_contact();
  if (!is_in()) return;
  outcome_.insertion_depth = cut_.tip_s;
  set_shaft(is_reinitialized ? nullptr : last_field);
  add_shaft(is_reinitialized ? 0 : motion.dot(axis));
  if (state_ == ContactState::kInserted) add_tip();
}

void NeedleContact::skip() noexcept {
  outcome_.landmarks.clear();
  outcome_.has_tip_landmark = false;
  if (bend_) bend_->clear();
  outcome_.flags = 0;
  outcome_.forces = {};
  outcome_.local_model = {};
  outcome_.tip_depth = 0;
}

void NeedleContact::set_needle(const RigidTransform& X_WN, const RigidTransform& X_BN) noexcept {
  needle_.tip = needle_.bent_tip = needle_.free_tip = X_BN.p;
  needle_.axis = X_BN.R.col(2);
  needle_.hub = needle_.free_hub = needle_.tip - needle_settings_.length_mm * needle_.axis;
  needle_.course.begin(X_WN, X_BN);
  if (needle_.course.is_followed()) needle_.free_hub = needle_.tip - kSideOfCourseMm * needle_.axis;
}

// A hole that holds the needle aside turns what is beyond it: where nothing else presses on it, it is straight there.
void NeedleContact::lay_free_line() noexcept {
  if (!bend_->is_held_aside()) return;
  const double length = needle_settings_.length_mm;
  needle_.free_tip += bend_->free_deflection(length);
  needle_.free_hub = needle_.free_tip - length * (needle_.axis + bend_->free_tip_slope()).normalized();
}

// The needle is in the tissue where its pose says, without any displacement.
void NeedleContact::reinitialize() noexcept {
  if (last_.is_known) outcome_.flags |= kStepReinitialized;
  release();
  needle_.bent_tip = needle_.tip;
  const bool inside = surface_.inside(needle_.tip);
  Vec3 exit = needle_.tip;
  bool entered = false, left = false;
  const std::size_t pieces = this->pieces();
  for (std::size_t k = 0; k < pieces; ++k) {
    const Vec3 from = end_of_piece(k), to = end_of_piece(k + 1);
    if (k == 0) cut_.path.start(from);
    std::array<SurfaceHit, kMaxCrossings> buffer;
    for (const SurfaceHit& hit : std::span(buffer.data(), surface_.all_hits(from, to, buffer))) {
      if (hit.entering) {
        cut_.path.start(hit.point);
        entered = true;
        left = false;
      } else {
        exit = hit.point - kInsideMargin * needle_.nearest(hit.point).axis;
        left = true;
        if (!inside) cut_.path.extend_to(exit);
      }
    }
    if (k + 1 < pieces && !left) cut_.path.extend_to(to);
  }
  if (!inside && !(entered && left)) return cut_.path.clear();

  state_ = inside ? ContactState::kInserted : ContactState::kThrough;
  old_.was_inserted = true;
  if (inside) cut_.path.extend_to(needle_.tip);
  cut_.tip_s = cut_.path.length();
  cut_.tissue = tissues_.at(cut_.path.at(cut_.tip_s));
}

// A course is asked for its crossings piece by piece, from the hub on; piece k is between ends k and k + 1.
std::size_t NeedleContact::pieces() const noexcept {
  if (!needle_.course.is_followed()) return 1;
  return static_cast<std::size_t>(std::ceil(needle_settings_.length_mm / kPieceMm));
}

Vec3 NeedleContact::end_of_piece(std::size_t piece) const noexcept {
  if (!needle_.course.is_followed()) return piece == 0 ? needle_.hub : needle_.tip;
  const double behind = kPieceMm * static_cast<double>(pieces() - piece);
  return needle_.course.point(std::min(behind, needle_settings_.length_mm));
}

void NeedleContact::approach() noexcept {
  auto hit = surface_.first_hit(last_.free_tip, needle_.free_tip);
  if (hit && !hit->entering) hit.reset();
  const bool along = hit && comes_along(hit->normal);
  press_.not_pressed = 0;
  if (along || (hit && hit->normal.dot(needle_.axis) <= kFacing)) {
    CutPath* const old = along ? find_old_path(hit->point) : nullptr;
    if (old) return enter_old_path(*old);
    press_.point = hit->point;
    if (!along) press_.not_pressed = std::max(0.0, (needle_.free_tip - press_.point).dot(needle_.axis));
    press_.by_tip = true;
  } else if (side_.begin(needle_.free_hub, needle_.free_tip, needle_.free_tip - last_.free_tip) &&
             !comes_along(side_.normal())) {
    press_.by_tip = false;
  } else if (surface_.inside(needle_.free_tip)) {
    // A needle that has slid off the far side is out before all of its thickness is.
    const double depth = -surface_.closest_point(needle_.free_tip).signed_distance;
    if (!body_.is_moving && depth > needle_settings_.diameter_mm) return reinitialize();
    press_.by_tip = body_.is_moving;
    if (press_.by_tip) {  // the gland has come to the tip
      press_.point = surface_.closest_point(needle_.free_tip).point;
      if (CutPath* old = find_old_path(press_.point)) return enter_old_path(*old);
    } else {
      side_.rest_at(needle_.free_tip, needle_.axis);
    }
  } else {
    return;
  }
  state_ = ContactState::kTouching;
  press_.slid = press_.advanced = 0;
  if (press_.by_tip) press();
}

// Whether the needle has come through a surface with that outward normal more by its way along itself than by its way
// across.
bool NeedleContact::comes_along(const Vec3& normal) const noexcept {
  const Vec3 motion = needle_.free_tip - last_.free_tip;
  const double along = motion.dot(needle_.axis) * -normal.dot(needle_.axis);
  return along > 0 && along >= -normal.dot(needle_.across(motion));
}

// The capsule has a hole where the needle was before, and the tissue behind it a cut.
CutPath* NeedleContact::find_old_path(const Vec3& entry) noexcept {
  for (CutPath& old : old_.paths) {
    if (old.empty()) continue;
    const Vec3 start = old.at(0), way = old.at(settings_.landmark_spacing_mm) - start;
    if ((start - entry).norm() <= kSameEntry * needle_settings_.diameter_mm &&
        way.dot(needle_.axis) >= kSameDirection * way.norm())
      return &old;
  }
  return nullptr;
}

void NeedleContact::enter_old_path(CutPath& old) noexcept {
  std::swap(cut_.path, old);
  old.clear();
  state_ = ContactState::kInserted;
  cut_.tip_s = 0;
  cut_.tissue = tissues_.at(cut_.path.at(cut_.path.length()));
}

void NeedleContact::press() noexcept {
  const bool tip_inside = is_inside();
  if (!tip_inside && !surface_.first_hit(needle_.hub, needle_.bent_tip)) return release();

  if (press_.has_punctured) return enter();
  const Vec3 off_axis = needle_.across(needle_.free_tip - press_.point);
  if (!tip_inside &&
      off_axis.norm() > settings_.surface_slip_mm) {  // dragged off: only the shaft can touch now
    if (!side_.begin(needle_.free_hub, needle_.free_tip, off_axis)) return release();
    press_.by_tip = false;
    return;
  }

  // The contact point slides over the capsule once it has been dragged aside too far.
  const Vec3 before = press_.point, drag = needle_.across(needle_.bent_tip - press_.point);
  if (const double length = drag.norm(); length > settings_.surface_slip_mm)
    press_.point =
        surface_.closest_point(press_.point + (1 - settings_.surface_slip_mm / length) * drag).point;
  if (bend_) slide_downhill();
  press_.not_pressed = std::max(0.0, press_.not_pressed + (before - press_.point).dot(needle_.axis));
}

// What the needle's tip has gone along it while it lies beside the tissue presses on what is in front of it.
void NeedleContact::press_beside() noexcept {
  if (press_.has_punctured) return enter();
  if (!side_.update(needle_.free_hub, needle_.free_tip, needle_.moved)) {
    if (!surface_.inside(needle_.free_tip)) return release();
    side_.rest_at(needle_.free_tip, needle_.axis);
  }
  const double advance = (needle_.tip - last_.tip).dot(needle_.axis);
  press_.advanced = side_.below_tip() ? std::max(0.0, press_.advanced + advance) : 0;
  if (side_.below_tip()) press_.point = *side_.below_tip();
}

// Bent or not: once released it springs back to its line.
bool NeedleContact::is_inside() const noexcept {
  return surface_.inside(needle_.free_tip) || (bend_ && surface_.inside(needle_.bent_tip));
}

void NeedleContact::enter() noexcept {
  press_.relaxed_n.setZero();
  state_ = ContactState::kInserted;
  old_.was_inserted = true;
  press_.has_punctured = false;
  cut_.path.start(press_.point);
  cut_.tip_s = 0;
  cut_.tissue = tissues_.at(press_.point + kInsideMargin * needle_.axis);
}

void NeedleContact::follow_path(const DisplacementField* last_field) noexcept {
  if (state_ == ContactState::kThrough) {
    const Vec3 exit = cut_.path.at(cut_.path.length());
    const Vec3 carried = last_field ? last_field->displacement_at(exit) : Vec3(Vec3::Zero());
    if ((needle_.bent_tip - exit - carried).dot(needle_.axis) > 0) return;
    state_ = ContactState::kInserted;
    cut_.tip_s = cut_.path.length();
  }
  if (cut_.tip_s == 0 && !is_inside()) return release();
  if (cut_.tip_s < cut_.path.length() &&
      needle_.across(needle_.bent_tip - cut_.path.at(cut_.tip_s)).norm() > settings_.leave_path_mm) {
    cut_.path.cut_off(cut_.tip_s);
    cut_.tissue = tissues_.at(cut_.path.at(cut_.tip_s));
    cut_.capsule_of = 0;
  }
}

// Shaft landmarks lie on the cut path every spacing, from the entry on. One is added when the tip is half a spacing
// past it and removed at a quarter, so that it never comes near the tip's own landmark and does not flicker.
void NeedleContact::set_shaft(const DisplacementField* last_field) noexcept {
  const double spacing = settings_.landmark_spacing_mm;
  const auto s_of_last = [&] { return spacing * (static_cast<double>(cut_.shaft.size()) - 1); };
  while (!cut_.shaft.empty() && cut_.tip_s < s_of_last() + 0.25 * spacing) cut_.shaft.pop_back();
  while (cut_.tip_s >= s_of_last() + 1.5 * spacing &&
         cut_.shaft.size() + 1 < static_cast<std::size_t>(settings_.max_landmarks)) {
    const Vec3 X = cut_.path.at(s_of_last() + spacing);
    const double carried = last_field ? last_field->displacement_at(X).dot(needle_.nearest(X).axis) : 0;
    cut_.shaft.push_back({X, tissues_[tissues_.at(X)].friction_n_per_mm, carried});
  }
}

// Length of shaft, mm, that rubs at a shaft landmark, or at the tip (the number of shaft landmarks): half the way
// to each neighbour. The last landmark's share grows from nothing while the tip advances, and its neighbours'
// shrink, so that no force jumps when one is added or removed.
double NeedleContact::tributary(std::size_t landmark) const noexcept {
  const double spacing = settings_.landmark_spacing_mm;
  const std::size_t count = cut_.shaft.size();
  const bool tip = outcome_.has_tip_landmark;
  // Of the first `set` landmarks and the tip.
  const auto share = [&](std::size_t set) {
    const auto s = [&](std::size_t i) { return i < set ? spacing * static_cast<double>(i) : cut_.tip_s; };
    const std::size_t all = set + (tip ? 1 : 0), i = landmark == count ? set : landmark;
    if (i >= all) return 0.0;
    const double from = i == 0 ? 0 : 0.5 * (s(i - 1) + s(i));
    const double to = i + 1 == all ? cut_.tip_s : 0.5 * (s(i) + s(i + 1));
    return to - from;
  };
  if (count == 0) return share(0);
  const double past = cut_.tip_s - spacing * static_cast<double>(count - 1);
  const double grown = std::clamp(2 * past / spacing - 1, 0.0, 1.0);
  const double without = landmark + 1 == count ? 0 : share(count - 1);
  return (1 - grown) * without + grown * share(count);
}

void NeedleContact::release() noexcept {
  if (is_in() && !cut_.path.empty()) {
    std::swap(cut_.path, old_.paths[old_.next]);
    old_.next = (old_.next + 1) % old_.paths.size();
    cut_.path.clear();
  }
  state_ = old_.was_inserted ? ContactState::kWithdrawn : ContactState::kFree;
  cut_.shaft.clear();
  side_.clear();
  cut_.tip_s = 0;
  cut_.capsule_of = 0;
  press_.has_punctured = false;
  last_.tip_reaction_n = 0;
  press_.relaxed_n.setZero();
  if (bend_) bend_->clear();
}

double NeedleContact::depth_of_tip() const noexcept {
  if (state_ == ContactState::kTouching)
    return press_.by_tip ? (needle_.tip - press_.point).dot(needle_.axis) : press_.advanced;
  return is_in() ? cut_.tip_s + (needle_.tip - cut_.path.at(cut_.tip_s)).dot(needle_.axis) : 0;
}

// How far the tip has indented the capsule by its way along the needle, mm.
double NeedleContact::pressed_mm() const noexcept {
  return press_.by_tip ? std::max(0.0, (needle_.tip - press_.point).dot(needle_.axis) - press_.not_pressed)
                       : press_.advanced;
}

void NeedleContact::add_contact() noexcept {
  if (!press_.by_tip) add_side();
  if (!press_.by_tip && !(press_.advanced > LandmarkSet::kRestToleranceMm)) return;
  NeedleLandmark landmark{.position = press_.point, .axis = needle_.axis, .relaxed_n = press_.relaxed_n};
  const TissueContact& capsule = tissues_[0];
  const double pressed = pressed_mm();
  landmark.if_stuck = needle_.tip - press_.point;
  if (!press_.by_tip) landmark.if_stuck = needle_.across(landmark.if_stuck) + pressed * needle_.axis;
  // What is across is the side's, but where its point is too near for a landmark of its own.
  const auto is_near = [&](const NeedleLandmark& other) {
    return (other.position - press_.point).norm() < needle_settings_.diameter_mm;
  };
  landmark.slides = !press_.by_tip && std::erase_if(outcome_.landmarks, is_near) == 0;
  if (capsule.puncture_force_n > 0)
    landmark.high_n = std::min(capsule.puncture_force_n, capsule.indentation_force_n(pressed));
  const double indentation = press_.by_tip ? (needle_.bent_tip - press_.point).norm() : pressed;
  const double stiffness = capsule.indentation_stiffness_n_per_mm(indentation);
  if (settings_.tip_core_mm > 0 || !(stiffness > 0))  // 0: the law of a capsule that takes no force
    landmark.spread.core_mm = settings_.inserted_tip_core_mm();
  else
    landmark.spread = {.stiffness_n_per_mm = stiffness, .axis = needle_.axis};
  add(landmark, landmark.if_stuck.dot(needle_.axis));
  if (press_.by_tip) return;
  // The side pushes in its direction only, also the tissue of a needle that is bent another way.
  Vec3& if_stuck = outcome_.landmarks.back().if_stuck;
  const Vec3& direction = side_.direction();
  if_stuck = if_stuck.dot(needle_.axis) * needle_.axis + std::max(0.0, if_stuck.dot(direction)) * direction;
}

// Pushed along one direction, in which a needle that bends gives way.
void NeedleContact::add_side() noexcept {
  if (side_.is_saturated()) outcome_.flags |= kStepSaturated;
  const Vec3& direction = side_.direction();
  for (const SideContact::Point& point : side_.points()) {
    if (outcome_.landmarks.size() + 1 >= outcome_.landmarks.capacity()) break;
    NeedleLandmark landmark{.position = point.rest, .axis = direction, .slides = true};
    if (bend_) landmark.arc_mm = bend_->arc_of(point.rest);
    landmark.if_stuck = point.depth_mm * direction;
    landmark.high_n = landmark.friction_n = std::numeric_limits<double>::infinity();
    landmark.spread.core_mm = point.core_mm;
    outcome_.landmarks.push_back(landmark);
  }
}

// The bevel pushes the tip aside while it cuts, by its share of the cutting force.
void NeedleContact::set_tip_force() noexcept {
  const double cutting = state_ == ContactState::kInserted ? last_.tip_reaction_n : 0;
  bend_->set_tip_force(needle_settings_.bevel_force_share * cutting * bend_->bevel_direction());
}

// A capsule pushes back along its normal. Where the needle meets it obliquely, by more than friction holds, the tip
// of a needle that bends slides downhill, as far as the needle gives under what is left; a sharp tip not far.
void NeedleContact::slide_downhill() noexcept {
  const Vec3 normal = surface_.closest_point(press_.point).normal;
  const Vec3 down = needle_.axis - needle_.axis.dot(normal) * normal;
  const double into = std::max(-normal.dot(needle_.axis), kMostOblique), aslant = down.norm();
  const double left_n = last_.tip_reaction_n * (aslant / into - kTipFriction);
  const double length = needle_settings_.length_mm;
  const double wanted =
      std::min(settings_.surface_slip_mm, left_n * bend_->beam().compliance(length, length));
  if (wanted <= press_.slid) return;
  press_.point = surface_.closest_point(press_.point + (wanted - press_.slid) / aslant * down).point;
  press_.slid = wanted;
}

// `elastic` and `fem` treat a single landmark as a needle's point, not a shaft, and its friction would fold the field.
void NeedleContact::add_shaft(double motion) noexcept {
  outcome_.has_tip_landmark = state_ == ContactState::kInserted;
  for (std::size_t i = 0; i < cut_.shaft.size(); ++i) {
    const ShaftLandmark& shaft = cut_.shaft[i];
    const FollowedCourse::Place place = needle_.nearest(shaft.position);
    const Vec3 across = place.point - shaft.position;
    const double friction = (shaft.friction + barbs_n_per_mm()) * tributary(i);
    add({.position = shaft.position,
         .axis = place.axis,
         .if_stuck = across + (shaft.axial + motion) * place.axis,
         .low_n = -friction,
         .high_n = friction,
         .friction_n = friction,
         .spread = {.core_mm = cut_.shaft.size() == 1 ? settings_.landmark_spacing_mm : 0},
         .relaxed_n = shaft.relaxed_n},
        shaft.axial + (shaft.slips ? 0 : motion));
  }
}

// The tip has friction too, and pushes the tissue that it does not cut.
void NeedleContact::add_tip() noexcept {
  const Vec3 X = cut_.path.at(cut_.tip_s);
  const double friction =
      (tissues_[tissues_.at(X)].friction_n_per_mm + barbs_n_per_mm()) * tributary(cut_.shaft.size());
  add({.position = X,
       .axis = needle_.axis,
       .if_stuck = needle_.tip - X,
       .low_n = -friction,
       .high_n = friction + (cut_.tip_s < cut_.path.length() ? 0 : resistance()),
       .friction_n = friction,
       .spread = {.core_mm = settings_.inserted_tip_core_mm(),
                  .axis = needle_.axis,
                  .across_mm = 0.5 * settings_.landmark_spacing_mm},
       .relaxed_n = press_.relaxed_n},
      (needle_.tip - X).dot(needle_.axis) - std::max(0.0, last_.slip));
}

// What a locking needle's barbs hold, for each mm of shaft in the tissue.
double NeedleContact::barbs_n_per_mm() const noexcept {
  return is_locking_ && cut_.tip_s > 0 ? settings_.locking_force_n / cut_.tip_s : 0;
}

// The force that extends the cut at the end of the path, N.
double NeedleContact::resistance() const noexcept {
  return cut_.capsule_of > 0 ? tissues_[cut_.capsule_of].puncture_force_n
                             : tissues_[cut_.tissue].cutting_force_n;
}

// Along and across the needle a landmark's displacement is limited. `axial`: how far it is carried by the end.
void NeedleContact::add(const NeedleLandmark& landmark, double axial) noexcept {
  const double limit = settings_.max_displacement_mm;
  outcome_.landmarks.push_back(landmark);
  const double along = landmark.if_stuck.dot(landmark.axis);
  const Vec3 across = landmark.if_stuck - along * landmark.axis;
  if (std::abs(along) > limit || across.norm() > limit) {
    outcome_.flags |= kStepSaturated;
    outcome_.landmarks.back().if_stuck = std::clamp(along, -limit, limit) * landmark.axis +
                                         across * std::min(1.0, limit / std::max(across.norm(), limit));
  }
  if (!bend_) return;
  NeedleLandmark& added = outcome_.landmarks.back();
  added.arc_mm = bend_->arc_of(landmark.position + axial * needle_.axis);
  added.if_stuck += bend_->free_deflection(added.arc_mm);
}

bool NeedleContact::reaches_uncut_tissue() noexcept {
  if (!outcome_.has_tip_landmark || cut_.free_slip > 0) return false;
  const double gap = cut_.path.length() - cut_.tip_s;
  NeedleLandmark& tip = outcome_.landmarks.back();
  if (gap <= 0 || tip.slip_mm <= gap) return false;
  cut_.free_slip = gap;
  tip.if_stuck -= gap * needle_.axis;
  tip.high_n += resistance();
  return true;
}

void NeedleContact::finish(std::uint64_t tick, double period_s, double axial_stiffness,
                           double lateral_stiffness) noexcept {
  if (bend_) {
    bend_->set_loads(outcome_.landmarks);
    if (bend_->is_steep()) outcome_.flags |= kStepSteep;
  }
  sum_forces();
  update_local_model(tick, axial_stiffness, lateral_stiffness);
  if (body_.is_turned) turn_to_world();
  if (const NeedleLandmark* pressing = pressing_landmark()) {
    const double full = tissues_[0].puncture_force_n;
    // A surface without a capsule opens at once.
    press_.has_punctured = full == 0 || pressing->reaction_n.dot(needle_.axis) >= full * (1 - 1e-9);
    if (press_.has_punctured) ++outcome_.puncture_count;
  }
  last_.tip_reaction_n = pressing_reaction();
  if (settings_.relaxation_share > 0) relax(period_s);
  if (!is_in()) return;
  for (std::size_t i = 0; i < cut_.shaft.size(); ++i) {
    cut_.shaft[i].slips = outcome_.landmarks[i].slip_mm != 0;
    const NeedleLandmark& landmark = outcome_.landmarks[i];
    const double axial = landmark.if_stuck.dot(landmark.axis) - landmark.slip_mm - landmark.body_mm;
    if (std::abs(axial - cut_.shaft[i].axial) > LandmarkSet::kRestToleranceMm) cut_.shaft[i].axial = axial;
  }
  last_.slip = outcome_.has_tip_landmark ? cut_.free_slip + outcome_.landmarks.back().slip_mm : 0;
  if (outcome_.has_tip_landmark && std::abs(last_.slip) > LandmarkSet::kRestToleranceMm) move_tip(last_.slip);
  outcome_.insertion_depth = cut_.tip_s;
}

void NeedleContact::finish_unsolved(std::uint64_t tick, double period_s) noexcept {
  const double kept = std::exp(-period_s / kUnsolvedFade);
  NeedleForces& f = outcome_.forces;
  for (Vec3* v : {&f.force_n, &f.guide_n, &f.tip_torque_nmm, &f.hub_torque_nmm}) *v *= kept;
  for (double* n : {&f.axial_n, &f.lateral_n, &f.cutting_n, &f.friction_n}) *n *= kept;
  press_.has_punctured = false;
  last_.tip_reaction_n = 0;
  const double motion = (needle_.tip - last_.tip).dot(needle_.axis);
  for (ShaftLandmark& shaft : cut_.shaft) shaft.slips = true;
  last_.slip = outcome_.has_tip_landmark ? motion : 0;
  if (outcome_.has_tip_landmark) move_tip(motion);
  outcome_.insertion_depth = is_in() ? cut_.tip_s : 0;
  outcome_.local_model = {};
  outcome_.local_model.tick = tick;
  outcome_.local_model.in_contact = true;
  outcome_.local_model.is_stuck = false;
  outcome_.local_model.reference_tip = outcome_.local_model.contact_point = needle_.tip;
  outcome_.local_model.axis = needle_.axis;
  if (body_.is_turned) {
    outcome_.local_model.axis = body_.turn * needle_.axis;
    outcome_.local_model.reference_tip = outcome_.local_model.contact_point = last_.world_tip;
  }
  outcome_.local_model.lateral_n = outcome_.forces.force_n;
}

// Of a tip on the intact capsule, what it presses with; null: it does not.
const NeedleLandmark* NeedleContact::pressing_landmark() const noexcept {
  if (state_ != ContactState::kTouching || outcome_.landmarks.empty()) return nullptr;
  return press_.by_tip || outcome_.landmarks.back().axis == needle_.axis ? &outcome_.landmarks.back()
                                                                         : nullptr;
}

// dr/dt = (share · K⁻¹u − r)/τ at each landmark's material point. A tip that cuts comes to tissue that has not relaxed.
void NeedleContact::relax(double period_s) noexcept {
  const double done = 1 - std::exp(-period_s / settings_.relaxation_s);
  const auto relaxed = [&](const NeedleLandmark& landmark) {
    const Vec3 at_once = landmark.reaction_n + landmark.relaxed_n;
    return Vec3(landmark.relaxed_n + done * (settings_.relaxation_share * at_once - landmark.relaxed_n));
  };
  if (is_beside()) {
    press_.relaxed_n.setZero();
    return;
  }
  const bool has_shaft = is_in();
  for (std::size_t i = 0; has_shaft && i < cut_.shaft.size(); ++i)
    cut_.shaft[i].relaxed_n = relaxed(outcome_.landmarks[i]);
  if (!outcome_.has_tip_landmark && state_ != ContactState::kTouching) {
    press_.relaxed_n.setZero();
    return;
  }
  const double fresh = outcome_.has_tip_landmark ? (cut_.free_slip + outcome_.landmarks.back().slip_mm) /
                                                       settings_.landmark_spacing_mm
                                                 : 0;
  press_.relaxed_n = std::clamp(1 - std::abs(fresh), 0.0, 1.0) * relaxed(outcome_.landmarks.back());
}

// Of what the tip cuts or presses on, N.
double NeedleContact::pressing_reaction() const noexcept {
  const bool presses = pressing_landmark() != nullptr;
  if (outcome_.landmarks.empty() ||
      !(presses || (outcome_.has_tip_landmark && cut_.tip_s == cut_.path.length())))
    return 0;
  const double along = outcome_.landmarks.back().reaction_n.dot(needle_.axis);
  return std::max(0.0, presses ? along : along - outcome_.landmarks.back().friction_n);
}

// The tip has slipped past its material point.
void NeedleContact::move_tip(double distance) noexcept {
  if (distance <= 0 || cut_.tip_s + distance <= cut_.path.length()) {
    cut_.tip_s = std::max(0.0, cut_.tip_s + distance);
    return;
  }
  const double rest = cut_.tip_s + distance - cut_.path.length();
  if (cut_.capsule_of > 0) {
    ++outcome_.puncture_count;
    cut_.tissue = cut_.capsule_of;
    cut_.capsule_of = 0;
  }
  cut(rest);
}

void NeedleContact::cut(double distance) noexcept {
  const Vec3 from = cut_.path.at(cut_.path.length());
  // Along the tip's tangent, so that the tissue beside it keeps its displacement: X + u(X) = tip goes on to hold.
  const Vec3 ahead = bend_ ? Vec3(needle_.axis + 0.5 * (last_.slope + bend_->tip_slope())) : needle_.axis;
  const Vec3 to = from + stop_at_capsule(from, from + distance * ahead) * distance * ahead;
  // A cut from the entry starts on the surface and may report that entry: the first crossing outwards counts.
  std::array<SurfaceHit, 4> buffer;
  const std::span hits(buffer.data(), surface_.all_hits(from, to, buffer));
  const auto exit =
      std::find_if(hits.begin(), hits.end(), [](const SurfaceHit& hit) { return !hit.entering; });
  if (exit != hits.end()) {
    cut_.path.extend_to(exit->point - kInsideMargin * needle_.axis);
    state_ = ContactState::kThrough;
    cut_.capsule_of = 0;
  } else {
    cut_.path.extend_to(to);
  }
  cut_.tip_s = cut_.path.length();
}

// The share of the cut up to where it enters a tissue with a capsule; 1 where it enters none.
double NeedleContact::stop_at_capsule(const Vec3& from, const Vec3& to) noexcept {
  const std::size_t next = tissues_.at(to);
  if (next == cut_.tissue) return 1;
  if (next == 0 || tissues_[next].puncture_force_n == 0) {
    cut_.tissue = next;
    return 1;
  }
  double outside = 0, inside = 1;
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (outside + inside);
    (tissues_.at(from + middle * (to - from)) == next ? inside : outside) = middle;
  }
  cut_.capsule_of = next;
  return inside;
}

void NeedleContact::sum_forces() noexcept {
  outcome_.forces = {};
  for (const NeedleLandmark& landmark : outcome_.landmarks) {
    // What slides passes on nothing across its axis, though a little is left of it in the solution.
    const Vec3 force = landmark.slides ? Vec3(-landmark.reaction_n.dot(landmark.axis) * landmark.axis)
                                       : Vec3(-landmark.reaction_n);
    Vec3 at = needle_.nearest(landmark.position + landmark.if_stuck - landmark.body).point;
    if (bend_ && &landmark == &outcome_.landmarks.back())
      at += bend_->tip_deflection();  // of the others, little
    outcome_.forces.force_n += force;
    outcome_.forces.tip_torque_nmm += (at - needle_.tip).cross(force);
    const double along = -force.dot(is_in() ? landmark.axis : needle_.axis);
    const double rubbed = std::clamp(along, -landmark.friction_n, landmark.friction_n);
    outcome_.forces.friction_n += rubbed;
    outcome_.forces.cutting_n += std::max(0.0, along - rubbed);
  }
  if (bend_) {
    outcome_.forces.force_n += bend_->tip_force_n();
    outcome_.forces.tip_torque_nmm += bend_->tip_deflection().cross(bend_->tip_force_n());
  }
  outcome_.forces.axial_n = outcome_.forces.cutting_n + outcome_.forces.friction_n;
  outcome_.forces.lateral_n = needle_.across(outcome_.forces.force_n).norm();
  if (bend_) add_guide();
  outcome_.forces.hub_torque_nmm =
      outcome_.forces.tip_torque_nmm + (needle_.tip - needle_.hub).cross(outcome_.forces.force_n);
}

// What the template's hole does, which the hand feels beside the tissue.
void NeedleContact::add_guide() noexcept {
  outcome_.forces.guide_n = bend_->guide_force_n();
  outcome_.forces.force_n += outcome_.forces.guide_n;
  outcome_.forces.tip_torque_nmm += bend_->guide_place().cross(outcome_.forces.guide_n);
}

// Contact is solved in the body's frame; forces and the local model are the world's.
void NeedleContact::turn_to_world() noexcept {
  for (Vec3* v :
       {&outcome_.forces.force_n, &outcome_.forces.guide_n, &outcome_.forces.tip_torque_nmm,
        &outcome_.forces.hub_torque_nmm, &outcome_.local_model.axis, &outcome_.local_model.lateral_n})
    *v = body_.turn * *v;
  for (Vec3* p : {&outcome_.local_model.reference_tip, &outcome_.local_model.contact_point})
    *p = last_.world_tip + body_.turn * (*p - needle_.tip);
}

// The local stiffness is that of the capsule's indentation where it is softer than the tissue, else the tissue's.
void NeedleContact::update_local_model(std::uint64_t tick, double axial_stiffness,
                                       double lateral_stiffness) noexcept {
  LocalContactModel& m = outcome_.local_model;
  m = {};
  m.tick = tick;
  m.reference_tip = needle_.tip;
  m.contact_point = needle_.tip;
  m.axis = needle_.axis;
  if (bend_ && bend_->is_held_by_template()) {
    m.in_contact = true;
    m.lateral_n = outcome_.forces.guide_n;
    m.lateral_stiffness_n_per_mm = bend_->stiffness_at_hole();
  }
  if (outcome_.landmarks.empty()) return m.in_contact ? void() : add_capsule_ahead();
  m.in_contact = true;
  // A side that a hole turns pushes a little along the needle, whatever the needle's way.
  const double aslant_n = pushed_aslant_n(), axial_n = outcome_.forces.axial_n - aslant_n;
  m.lateral_n = needle_.across(outcome_.forces.force_n - outcome_.forces.guide_n) - aslant_n * needle_.axis +
                outcome_.forces.guide_n;
  m.lateral_stiffness_n_per_mm += lateral_stiffness;
  m.axial_stiffness_n_per_mm = axial_stiffness;
  for (const NeedleLandmark& landmark : outcome_.landmarks) {
    if (!is_along(landmark)) continue;
    m.axial_min_n += landmark.low_n;
    m.axial_max_n += landmark.high_n;
    m.is_stuck &= landmark.slip_mm == 0;
  }
  m.is_capsule = outcome_.has_tip_landmark && cut_.capsule_of > 0 && cut_.tip_s == cut_.path.length();
  m.after_puncture_n = m.axial_max_n;
  if (m.is_capsule) m.after_puncture_n += tissues_[cut_.capsule_of].cutting_force_n - resistance();
  if (state_ == ContactState::kTouching) {
    const TissueContact& capsule = tissues_[0];
    // What only pushes gives no force until it presses; so it waits where the tissue pushes the needle aside already.
    const NeedleLandmark* pressing = pressing_landmark();
    if (axial_n < kNoForceN) pressing = nullptr;
    m.is_capsule = pressing != nullptr;
    m.axial_max_n = pressing ? capsule.puncture_force_n : 0;
    m.after_puncture_n = pressing ? capsule.cutting_force_n : 0;
    const double of_law = capsule.capsule_n_per_mm + 2 * capsule.capsule_n_per_mm2 * pressed_mm();
    // Of a core by the law itself `axial_stiffness` is its secant.
    m.axial_stiffness_n_per_mm = !pressing                      ? 0
                                 : pressing->spread.core_mm > 0 ? std::min(axial_stiffness, of_law)
                                                                : of_law;
  }
  m.axial_max_n = std::max(m.axial_max_n, (1 + kRounding) * axial_n);  // a puncture is the next tick's
  if (m.axial_stiffness_n_per_mm > 0) m.contact_point -= axial_n / m.axial_stiffness_n_per_mm * needle_.axis;
}

// Along the needle, of what lies beside it, N.
double NeedleContact::pushed_aslant_n() const noexcept {
  double sum = 0;
  if (!is_beside() || !bend_ || !bend_->is_held_aside()) return sum;
  for (const NeedleLandmark& landmark : outcome_.landmarks)
    if (landmark.axis != needle_.axis)
      sum += landmark.reaction_n.dot(landmark.axis) * landmark.axis.dot(needle_.axis);
  return sum;
}

void NeedleContact::add_capsule_ahead() noexcept {
  const auto hit = surface_.first_hit(needle_.free_tip, needle_.free_tip + kLookAhead * needle_.axis);
  if (!hit || !hit->entering || find_old_path(hit->point)) return;
  const TissueContact& capsule = tissues_[0];
  outcome_.local_model.contact_point = hit->point;
  outcome_.local_model.is_capsule = true;
  outcome_.local_model.axial_stiffness_n_per_mm = capsule.capsule_n_per_mm;
  outcome_.local_model.axial_max_n = capsule.puncture_force_n;
  outcome_.local_model.after_puncture_n = capsule.cutting_force_n;
}

double NeedleContact::load() const noexcept {
  const double full = tissues_[0].puncture_force_n;
  return full > 0 ? std::min(1.0, (outcome_.forces.force_n - outcome_.forces.guide_n).norm() / full) : 0;
}

}  // namespace brachy
