#include "core/brachytherapy/structures/organ_contacts.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace brachy {
namespace {

constexpr double kScanMm = 5;  // pieces of a path whose course the tip was not seen to take
constexpr std::size_t kMaxPiercings = 16;

// The part of a → b whose coordinate along the axis is in [from, to]; false: none.
bool clip(Vec3& a, Vec3& b, const Vec3& axis, double from, double to) {
  const double at_a = a.dot(axis), at_b = b.dot(axis);
  if (std::max(at_a, at_b) <= from || std::min(at_a, at_b) >= to) return false;
  if (at_a == at_b) return true;
  const auto at = [&](double along) {
    return Vec3(a + std::clamp((along - at_a) / (at_b - at_a), 0.0, 1.0) * (b - a));
  };
  const Vec3 first = at(at_a < at_b ? from : to), last = at(at_a < at_b ? to : from);
  a = std::isfinite(first.sum()) ? first : a;
  b = std::isfinite(last.sum()) ? last : b;
  return true;
}

}  // namespace

OrganContacts::OrganContacts(const std::vector<TestedOrgan>& organs)
    : organs_(organs), came_in_s_(organs.size(), kNowhere), pass_s_(organs.size(), kNowhere) {}

void OrganContacts::update(std::uint64_t tick, double period_s, const NeedleCourse* course,
                           std::span<OrganContact> contacts) noexcept {
  if (!course) {
    for (OrganContact& contact : contacts) {
      if (std::exchange(contact.is_in, false)) contact.left_tick = tick;
    }
    std::ranges::fill(came_in_s_, kNowhere);
    last_s_ = 0;
    last_free_tip_.reset();
    return;
  }
  take_samples(*course);
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    const Touch inside = within_tissue(k, *course), outside = outside_tissue(organs_[k], *course);
    Touch touch{inside.is_in || outside.is_in, std::max(inside.depth_mm, outside.depth_mm)};
    if (organs_[k].is_bone) touch.is_in |= course->is_stopped;
    begin_or_end(k, tick, *course, touch, contacts[k]);
    if (!contacts[k].is_in) continue;
    contacts[k].depth_mm = std::max(contacts[k].depth_mm, touch.depth_mm);
    if (touch.is_in) contacts[k].time_s += period_s;
  }
}

// The tip's way since the last tick, within the tissue and outside it.
void OrganContacts::take_samples(const NeedleCourse& course) noexcept {
  const auto count_for = [](double way) {
    return std::clamp<std::size_t>(static_cast<std::size_t>(std::ceil(way / kSampleMm)), 1, kMaxSamples);
  };
  material_count_ = 0;
  is_scanned_ = true;
  if (course.path) {
    const double way = std::max(0.0, course.tip_s - last_s_);
    is_scanned_ = way <= kSampleMm * kMaxSamples;
    material_count_ = count_for(way);
    for (std::size_t i = 0; i < material_count_; ++i) {
      const double s = course.tip_s - way * static_cast<double>(i) / static_cast<double>(material_count_);
      material_[i] = {course.path->at(s), s};
    }
    last_s_ = course.tip_s;
  } else {
    last_s_ = 0;
    if (course.pressed_at) material_[material_count_++] = {*course.pressed_at, 0};
  }
  free_count_ = 0;
  const bool is_free = course.path ? course.is_through : !course.pressed_at;
  const Vec3 tip = course.points.back();
  if (is_free) {
    const Vec3 last = last_free_tip_.value_or(tip);
    free_count_ = count_for((tip - last).norm());
    for (std::size_t i = 0; i < free_count_; ++i)
      free_[i].at = tip - static_cast<double>(i) / static_cast<double>(free_count_) * (tip - last);
    last_free_tip_ = tip;
  } else {
    last_free_tip_.reset();
  }
}

OrganContacts::Touch OrganContacts::within_tissue(std::size_t organ, const NeedleCourse& course) noexcept {
  double& came_in = came_in_s_[organ];
  if (!course.path) came_in = kNowhere;
  if (!is_scanned_) scan_path(organ, course);
  Touch touch;
  for (std::size_t i = 0; i < material_count_; ++i) {
    const auto& [at, s] = material_[i];
    if (!organs_[organ].may_hold(at)) continue;
    const double depth = -organs_[organ].surface->closest_point(at).signed_distance;
    if (!(depth > 0)) continue;
    touch.depth_mm = std::max(touch.depth_mm, depth);
    if (!course.path) touch.is_in = true;
    came_in = std::min(came_in, s);
  }
  if (!course.path) return touch;
  touch.is_in = course.tip_s >= came_in;
  if (!touch.is_in) came_in = kNowhere;
  return touch;
}

// A needle that was put in at once, or fast: where its path came into the organ.
void OrganContacts::scan_path(std::size_t organ, const NeedleCourse& course) noexcept {
  const SurfaceBvh& surface = *organs_[organ].surface;
  for (double s = 0; s < course.tip_s; s += kScanMm) {
    const Vec3 a = course.path->at(s), b = course.path->at(std::min(s + kScanMm, course.tip_s));
    const auto hit = surface.first_hit(a, b);
    if (!hit) continue;
    const double at = hit->entering ? s + hit->t * (b - a).norm() : s;
    came_in_s_[organ] = std::min(came_in_s_[organ], at);
    return;
  }
}

OrganContacts::Touch OrganContacts::outside_tissue(const TestedOrgan& organ,
                                                   const NeedleCourse& course) const noexcept {
  Touch touch;
  const auto look_at = [&](const Vec3& p) {
    if (!organ.may_hold(p)) return false;
    const double depth = -organ.surface->closest_point(p).signed_distance;
    touch.depth_mm = std::max(touch.depth_mm, depth);
    return depth > 0;
  };
  for (std::size_t i = 0; i < free_count_; ++i) touch.is_in |= look_at(free_[i].at) && i == 0;
  const bool is_in_tissue = course.path || course.pressed_at;
  const auto test = [&](Vec3 a, Vec3 b, double from, double to) {
    if (!clip(a, b, course.axis, from, to)) return;
    std::array<SurfaceHit, kMaxPiercings> hits;
    const std::size_t count = organ.surface->all_hits(a, b, hits);
    touch.is_in |= count > 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (i == 0 && !hits[i].entering) look_at(0.5 * (a + hits[i].point));
      if (hits[i].entering) look_at(0.5 * (hits[i].point + (i + 1 < count ? hits[i + 1].point : b)));
    }
  };
  for (std::size_t i = 0; i + 1 < course.points.size(); ++i) {
    const Vec3 &a = course.points[i], &b = course.points[i + 1];
    test(a, b, -kNowhere, is_in_tissue ? course.entry.dot(course.axis) : kNowhere);
    if (course.path && course.is_through) test(a, b, course.exit.dot(course.axis), kNowhere);
  }
  return touch;
}

void OrganContacts::begin_or_end(std::size_t organ, std::uint64_t tick, const NeedleCourse& course,
                                 const Touch& touch, OrganContact& contact) noexcept {
  const Vec3& tip = course.points.back();
  if (touch.is_in && !contact.is_in) {
    contact.is_in = true;
    ++contact.passes;
    contact.entered_tick = tick;
    contact.entered_at = tip;
    contact.axis = course.axis;
    contact.depth_mm = contact.time_s = 0;
    pass_s_[organ] = course.path ? came_in_s_[organ] : kNowhere;
  } else if (!touch.is_in && contact.is_in) {
    const Vec3 way = tip - contact.entered_at;
    const double along = way.dot(contact.axis);
    const bool is_out = pass_s_[organ] < kNowhere
                            ? !course.path || course.tip_s < pass_s_[organ] - OrganContact::kDrawnBackMm
                            : along < -OrganContact::kDrawnBackMm ||
                                  (way - along * contact.axis).norm() > OrganContact::kDrawnBackMm;
    if (!is_out) return;
    contact.is_in = false;
    contact.left_tick = tick;
  }
}

}  // namespace brachy
