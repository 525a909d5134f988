#include "core/elasticity/needle_rings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

constexpr double kMaxTurn = 0.8660254;  // cos 30°

// Cosine and sine of the angles at which a ring's points lie; and of those between them, where the next ring's do.
std::array<std::array<std::array<double, 2>, NeedleRings::kPoints>, 2> directions_on_rings() {
  std::array<std::array<std::array<double, 2>, NeedleRings::kPoints>, 2> directions;
  for (std::size_t turned = 0; turned < 2; ++turned)
    for (std::size_t k = 0; k < NeedleRings::kPoints; ++k) {
      const double turn = turned ? 0.5 : 0;
      const double angle = 2 * std::numbers::pi * (static_cast<double>(k) + turn) / NeedleRings::kPoints;
      directions[turned][k] = {std::cos(angle), std::sin(angle)};
    }
  return directions;
}
const auto kDirectionsOnRings = directions_on_rings();

bool continues_shaft(const Vec3* before, const Vec3& a, const Vec3& b, double max_gap) {
  const double gap = (b - a).norm();
  if (gap == 0 || gap > max_gap) return false;
  return before == nullptr || (a - *before).normalized().dot((b - a) / gap) > kMaxTurn;
}

// How much a shaft's ends are round, 0 to 1. One shorter than two round ends is a disc or a cylinder with rims. Chosen
// for flat cylinders of 0.5 to 1.9 R (tests/reference/short_contacts).
double end_roundness(double length_in_radii) {
  const double share = std::min(1.0, length_in_radii / 2);
  return 0.5 * (share + std::pow(share, 7));
}

// Rings on the way from one landmark to the next, its own at the start included.
int rings_between(double distance, double radius) {
  return std::clamp(static_cast<int>(std::ceil(distance / (NeedleRings::kSpacing * radius) - 1e-2)), 1,
                    NeedleRings::kMaxRingsBetween);
}

}  // namespace

void NeedleRings::reserve(std::size_t landmarks) {
  rings_.reserve(landmarks * kMaxRingsBetween);
  spacing_.reserve(landmarks * kMaxRingsBetween);
  points_.reserve(landmarks * kMaxRingsBetween * kPoints);
  shaft_.reserve(landmarks);
}

void NeedleRings::clear() noexcept {
  rings_.clear();
  points_.clear();
  spacing_.clear();
}

void NeedleRings::build(std::span<const Vec3> positions, std::span<const double> cores, double radius,
                        std::span<const LandmarkSpread> spreads) {
  clear();
  const std::size_t n = positions.size();
  goes_on_ = n <= kGoesOnUpTo;
  const double max_gap = kMaxGap * std::max(1.0, radius);
  const auto core_of = [&](std::size_t i) { return i < cores.size() ? cores[i] : 0; };
  // The tip with a core that goes on from landmark `behind`; n: none.
  const auto tip_after = [&](std::size_t behind) {
    for (std::size_t tip = 0; tip < std::min(n, spreads.size()); ++tip)
      if (spreads[tip].behind == static_cast<std::int32_t>(behind) && tip != behind && core_of(tip) > 0 &&
          !(behind < spreads.size() && spreads[behind].behind >= 0) &&
          continues_shaft(nullptr, positions[behind], positions[tip], max_gap))
        return tip;
    return n;
  };
  const auto is_taken = [&](std::size_t tip) {
    if (tip >= spreads.size() || spreads[tip].behind < 0) return false;
    const auto behind = static_cast<std::size_t>(spreads[tip].behind);
    return behind < n && tip_after(behind) == tip;
  };
  for (std::size_t begin = 0; begin < n;) {
    std::size_t end = begin + 1;
    while (end < n && !(core_of(begin) > 0) && !(core_of(end) > 0) && tip_after(end - 1) == n &&
           continues_shaft(end - begin > 1 ? &positions[end - 2] : nullptr, positions[end - 1],
                           positions[end], max_gap))
      ++end;
    shaft_.clear();
    const std::size_t tip = tip_after(end - 1);
    const bool has_tip = tip < n;
    if (!is_taken(begin))
      for (std::size_t i = begin; i < end; ++i) shaft_.push_back(static_cast<std::uint32_t>(i));
    if (has_tip) shaft_.push_back(static_cast<std::uint32_t>(tip));
    if (shaft_.size() > 1)
      add_shaft(positions, cores, has_tip, radius);
    else if (shaft_.size() == 1)
      add_lone(positions[begin], core_of(begin), radius, shaft_[0],
               begin < spreads.size() ? spreads[begin] : LandmarkSpread{});
    begin = end;
  }
}

void NeedleRings::add_lone(const Vec3& position, double core, double radius, std::uint32_t landmark,
                           const LandmarkSpread& spread) {
  add_point(
      position,
      core > 0 ? PointCore::of_landmark(core) : PointCore::of_surface(0.5 * std::pow(kDiscCore * radius, 2)),
      landmark);
  if (!(core > 0) || !(spread.across_mm > 0)) return;
  rings_.back().axis = spread.axis;
  rings_.back().across = {0, 0};
  add_point(position, PointCore::of_landmark(std::min(core, spread.across_mm)), landmark);
  rings_.back().axis = spread.axis;
  rings_.back().along = rings_.back().smooth = {0, 0};
}

void NeedleRings::add_point(const Vec3& position, const PointCore& core, std::uint32_t landmark) {
  Ring ring;
  ring.centre = position;
  ring.axis = Vec3::Zero();
  ring.core = core;
  ring.first = static_cast<std::uint32_t>(points_.size());
  ring.landmark = {landmark, landmark};
  ring.across = ring.along = ring.smooth = {1, 0};
  rings_.push_back(ring);
  spacing_.push_back(0);
  points_.push_back(position);
}

void NeedleRings::set_core(std::size_t r, double core) noexcept {
  rings_[r].core = PointCore::of_landmark(core);
}

NeedleRings::Piece NeedleRings::piece_at(std::size_t first, std::size_t count) const {
  const Ring& ring = rings_[first];
  std::size_t end = first + 1;
  while (end < count && ring.count > 1 && rings_[end].count > 1 && rings_[end].landmark == ring.landmark)
    ++end;
  const Vec3& last = rings_[end - 1].centre;
  Piece piece{static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(end - first),
              0.5 * (ring.centre + last), 0.5 * (last - ring.centre).norm(), 0};
  double square = 0;
  for (std::size_t r = first; r < end; ++r) {
    const double t = (rings_[r].centre - piece.centre).dot(ring.axis);
    square += t * t / piece.count;
  }
  piece.arm = std::sqrt(square);
  return piece;
}

void NeedleRings::append(const NeedleRings& others) {
  const auto first = static_cast<std::uint32_t>(points_.size());
  for (Ring ring : others.rings_) {
    ring.first += first;
    rings_.push_back(ring);
  }
  points_.insert(points_.end(), others.points_.begin(), others.points_.end());
  spacing_.insert(spacing_.end(), others.spacing_.begin(), others.spacing_.end());
}

void NeedleRings::move(std::size_t r, const Vec3& by) noexcept {
  Ring& ring = rings_[r];
  ring.centre += by;
  for (std::uint32_t i = ring.first; i < ring.first + ring.count; ++i) points_[i] += by;
}

// Of shaft_. Landmarks on it with a core have points of their own for what is along it.
void NeedleRings::add_shaft(std::span<const Vec3> positions, std::span<const double> cores, bool has_tip,
                            double radius) {
  const std::size_t first_ring = rings_.size(), count = shaft_.size();
  const auto is_turned = [&] { return (rings_.size() - (goes_on_ ? 0 : first_ring)) % 2 != 0; };
  const auto p = [&](std::size_t i) -> const Vec3& { return positions[shaft_[i]]; };
  const auto core_of = [&](std::size_t i) { return shaft_[i] < cores.size() ? cores[shaft_[i]] : 0; };
  const double roundness = end_roundness((p(count - 1) - p(0)).norm() / radius);
  const double inset = roundness * kEndInset * radius;
  const double end_radius =
      radius * std::lerp(1.0, std::sqrt(1 - (1 - kEndInset) * (1 - kEndInset)), roundness);
  double before = 0;  // ring spacing of the segment before
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const double distance = (p(i + 1) - p(i)).norm();
    const int parts = rings_between(distance, radius);
    const Vec3 axis = (p(i + 1) - p(i)) / distance;
    const double h = distance / parts;
    const bool is_way_to_tip = has_tip && i + 2 == count;
    for (int q = 0; q < parts; ++q) {
      const double t = static_cast<double>(q) / parts;
      const bool is_end = i == 0 && q == 0;
      add_ring(p(i) + (q * h + (is_end ? inset : 0)) * axis, axis, is_end ? end_radius : radius,
               q == 0 && before > 0 ? 0.5 * (before + h) : h, is_turned());
      Ring& ring = rings_.back();
      ring.landmark = {shaft_[i], shaft_[i + 1]};
      ring.across = {1 - t, t};
      for (std::size_t side = 0; side < 2; ++side)
        if (!(core_of(i + side) > 0)) ring.along[side] = ring.smooth[side] = ring.across[side];
      if (is_way_to_tip && count > 2 && q > 0) ring.smooth = {0, 0};
    }
    before = h;
  }
  const Vec3 axis = (p(count - 1) - p(count - 2)).normalized();
  add_ring(p(count - 1) - inset * axis, axis, end_radius, before, is_turned());
  rings_.back().landmark = {shaft_.back(), shaft_.back()};
  rings_.back().across = {1, 0};
  if (!(core_of(count - 1) > 0)) rings_.back().along = rings_.back().smooth = {1, 0};
  for (const std::size_t end : {first_ring, rings_.size() - 1})  // a flat end is as large as R/2 of the shaft
    spacing_[end] += 0.5 * (1 - roundness) * (radius - spacing_[end]);
  for (std::size_t k = first_ring; k < rings_.size();
       ++k) {  // cores by the shaft's own radius: end rings are narrower
    const double area = 2 * std::numbers::pi * radius / kPoints * spacing_[k];
    rings_[k].core = PointCore::of_surface(kCore * kCore * area / 2);
  }
  normalize(first_ring);
  for (std::size_t i = 0; i < count; ++i) {
    if (!(core_of(i) > 0)) continue;
    add_point(p(i), PointCore::of_landmark(core_of(i)), shaft_[i]);
    rings_.back().axis = axis;
    rings_.back().across = {0, 0};
  }
}

void NeedleRings::add_ring(const Vec3& centre, const Vec3& axis, double radius, double spacing, bool turned) {
  Ring ring;
  ring.centre = centre;
  ring.axis = axis;
  ring.radius = radius;
  ring.first = static_cast<std::uint32_t>(points_.size());
  ring.count = kPoints;
  const Vec3 e = axis.cross(std::abs(axis.y()) < 0.9 ? Vec3::UnitY() : Vec3::UnitX()).normalized();
  const Vec3 f = axis.cross(e);
  for (const auto& [cosine, sine] : kDirectionsOnRings[turned ? 1 : 0])
    points_.push_back(centre + radius * (cosine * e + sine * f));
  rings_.push_back(ring);
  spacing_.push_back(spacing);
}

// Of shaft_.
void NeedleRings::normalize(std::size_t first_ring) {
  // A landmark's rings are neighbours, so one pass with a running window would do; shafts are short.
  for (const std::uint32_t landmark : shaft_)
    for (const auto weights : {&Ring::across, &Ring::along, &Ring::smooth}) {
      double sum = 0;
      const auto each = [&](auto&& visit) {
        for (std::size_t k = first_ring; k < rings_.size(); ++k)
          for (std::size_t side = 0; side < 2; ++side)
            if (double& w = (rings_[k].*weights)[side]; rings_[k].landmark[side] == landmark && w > 0)
              visit(k, w);
      };
      each([&](std::size_t k, double& w) { sum += w *= spacing_[k]; });
      each([&](std::size_t, double& w) { w /= sum; });
    }
}

void NeedleRings::add_to(PointGroups& groups, std::uint32_t landmark) const {
  for (const Ring& ring : rings_)
    for (std::size_t side = 0; side < 2; ++side)
      if (ring.landmark[side] == landmark && ring.smooth[side] > 0)
        for (const Vec3& p : points(ring))
          groups.add(p, ring.core, ring.smooth[side] / static_cast<double>(ring.count));
}

PointGroups NeedleRings::groups(std::size_t landmarks) const {
  PointGroups groups;
  for (std::uint32_t l = 0; l < landmarks; ++l) {
    groups.begin_group();
    add_to(groups, l);
  }
  groups.finish();
  return groups;
}

}  // namespace brachy
