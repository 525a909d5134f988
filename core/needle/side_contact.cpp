#include "core/needle/side_contact.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace brachy {
namespace {

constexpr std::size_t kMostCrossings = 32;  // of one line with one surface
constexpr double kSteep = 0.75;        // cos²30°: a surface that slants less is pushed by all of the depth
constexpr double kLeastAcross = 1e-9;  // of a direction that may be normalized

// The core of a point that stands for `length` of a line of core c: both move themselves alike under a force across
// them. Kelvin's solution, regularised, at the middle of the line (core/DESIGN.md, section 3), for ν → ½.
double core_of(double length, double c) {
  const double half = 0.5 * length, along = std::asinh(half / c), end = half / std::hypot(half, c);
  return length / (along + end);
}

}  // namespace

SideContact::SideContact(const SurfaceBvh& surface, double radius, double max_depth_mm)
    : surface_(surface),
      radius_(radius),
      max_depth_(max_depth_mm),
      reach_((surface.max() - surface.min()).norm() + 2 * radius) {
  points_.reserve(kMaxPoints);
}

// The direction is not known before: towards where the needle moves, then against the surface's normals.
bool SideContact::begin(const Vec3& hub, const Vec3& tip, const Vec3& motion) noexcept {
  points_.clear();
  const Vec3 axis = (tip - hub).normalized(), across = motion - motion.dot(axis) * axis;
  if (!(across.norm() > kLeastAcross)) return false;
  direction_ = across.normalized();
  for (int round = 0; round < 3; ++round) {
    if (!find_points(hub, tip)) return false;
    turn(axis, -normal_, 1);
  }
  return find_points(hub, tip);
}

bool SideContact::update(const Vec3& hub, const Vec3& tip, double moved_mm) noexcept {
  const Vec3 axis = (tip - hub).normalized();
  turn(axis, -normal_, std::min(1.0, moved_mm / kTurnMm));
  return find_points(hub, tip);
}

void SideContact::rest_at(const Vec3& tip, const Vec3& axis) noexcept {
  const ClosestPoint nearest = surface_.closest_point(tip);
  turn(axis, direction_, 1);
  points_.clear();
  points_.push_back({nearest.point, 0, core_of(2 * radius_, kLineCore * radius_)});
  normal_.setZero();
  below_tip_.reset();
}

// Turns the direction by a share of the way, and keeps it across the needle.
void SideContact::turn(const Vec3& axis, const Vec3& towards, double share) noexcept {
  const auto across = [&](const Vec3& v) { return Vec3(v - v.dot(axis) * axis); };
  const Vec3 wanted = across(towards), now = across(direction_);
  Vec3 next = now;
  if (wanted.norm() > kLeastAcross && now.norm() > kLeastAcross)
    next = now.normalized() + share * (wanted.normalized() - now.normalized());
  direction_ = next.norm() > kLeastAcross ? Vec3(next.normalized()) : axis.unitOrthogonal();
}

// From inside the surface to it, back where the needle came from.
std::optional<SurfaceHit> SideContact::way_out(const Vec3& from) const noexcept {
  const auto hit = surface_.first_hit(from, from - reach_ * direction_);
  return hit && !hit->entering ? hit : std::nullopt;
}

bool SideContact::find_points(const Vec3& hub, const Vec3& tip) noexcept {
  points_.clear();
  is_saturated_ = false;
  below_tip_.reset();
  const Vec3 edge = radius_ * direction_, a = hub + edge, b = tip + edge;
  std::array<SurfaceHit, kMostCrossings> buffer;
  const std::span hits(buffer.data(), surface_.all_hits(a, b, buffer));
  const bool tip_inside = surface_.inside(b);
  if (hits.empty()) return false;
  const double length = (b - a).norm();
  const double from = hits.front().entering ? hits.front().t * length : 0;
  const double to = tip_inside ? length : hits.back().t * length;
  const double chord = to - from;
  if (!(chord > 0)) return false;

  const auto count = static_cast<std::size_t>(
      std::clamp(std::ceil(chord / kSpacingMm), 1.0, static_cast<double>(most_points_)));
  const double each = chord / static_cast<double>(count),
               core = core_of(std::max(each, 2 * radius_), kLineCore * radius_);
  const Vec3 axis = (b - a) / length;
  normal_.setZero();
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 q = a + (from + (static_cast<double>(k) + 0.5) * each) * axis;
    const auto out = way_out(q);
    if (!out) continue;  // between two lobes
    const auto far = surface_.first_hit(q, q + reach_ * direction_);
    const double slant = out->normal.dot(direction_);
    const double depth = std::min(1.0, slant * slant / kSteep) * (q - out->point).norm();
    const double left = far ? (far->point - q).norm() : 0;
    is_saturated_ |= std::min(depth, left) > max_depth_;
    points_.push_back({out->point, std::min({depth, left, max_depth_}), core});
    normal_ += depth * out->normal;
  }
  if (const auto out = tip_inside ? way_out(b) : std::nullopt) below_tip_ = out->point;
  return !points_.empty();
}

}  // namespace brachy
