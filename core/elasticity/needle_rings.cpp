#include "core/elasticity/needle_rings.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

constexpr double kMaxTurn = 0.8660254;  // cos 30°

bool continues_shaft(const Vec3* before, const Vec3& a, const Vec3& b, double max_gap) {
  const double gap = (b - a).norm();
  if (gap == 0 || gap > max_gap) return false;
  return before == nullptr || (a - *before).normalized().dot((b - a) / gap) > kMaxTurn;
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
}

void NeedleRings::build(std::span<const Vec3> positions, std::span<const double> cores, double radius) {
  rings_.clear();
  points_.clear();
  spacing_.clear();
  const double max_gap = kMaxGap * std::max(1.0, radius);
  const auto has_core = [&](std::size_t i) { return i < cores.size() && cores[i] > 0; };
  for (std::size_t begin = 0; begin < positions.size();) {
    std::size_t end = begin + 1;
    while (end < positions.size() && !has_core(begin) && !has_core(end) &&
           continues_shaft(end - begin > 1 ? &positions[end - 2] : nullptr, positions[end - 1],
                           positions[end], max_gap))
      ++end;
    const auto landmark = static_cast<std::uint32_t>(begin);
    if (end - begin > 1)
      add_shaft(positions.subspan(begin, end - begin), landmark, radius);
    else if (has_core(begin))
      add_point(positions[begin], PointCore::of_landmark(cores[begin]), landmark);
    else
      add_point(positions[begin], PointCore::of_surface(0.5 * std::pow(kDiscCore * radius, 2)), landmark);
    begin = end;
  }
}

void NeedleRings::add_point(const Vec3& position, const PointCore& core, std::uint32_t landmark) {
  Ring ring;
  ring.centre = position;
  ring.axis = Vec3::Zero();
  ring.core = core;
  ring.first = static_cast<std::uint32_t>(points_.size());
  ring.landmark = {landmark, landmark};
  ring.weight = {1, 0};
  rings_.push_back(ring);
  spacing_.push_back(0);
  points_.push_back(position);
}

void NeedleRings::set_core(std::size_t r, double core) noexcept {
  rings_[r].core = PointCore::of_landmark(core);
}

void NeedleRings::add_shaft(std::span<const Vec3> p, std::uint32_t first_landmark, double radius) {
  const std::size_t first_ring = rings_.size();
  double before = 0;  // ring spacing of the segment before
  for (std::size_t i = 0; i + 1 < p.size(); ++i) {
    const double distance = (p[i + 1] - p[i]).norm();
    const int parts = rings_between(distance, radius);
    const Vec3 axis = (p[i + 1] - p[i]) / distance;
    const double h = distance / parts;
    for (int q = 0; q < parts; ++q) {
      const double t = static_cast<double>(q) / parts;
      const bool is_end = i == 0 && q == 0;
      const double inset = is_end ? kEndInset * radius : 0;
      const double r = is_end ? radius * std::sqrt(1 - (1 - kEndInset) * (1 - kEndInset)) : radius;
      add_ring(p[i] + (q * h + inset) * axis, axis, r, q == 0 && before > 0 ? 0.5 * (before + h) : h);
      Ring& ring = rings_.back();
      ring.landmark = {first_landmark + static_cast<std::uint32_t>(i),
                       first_landmark + static_cast<std::uint32_t>(i) + 1};
      ring.weight = {1 - t, t};
    }
    before = h;
  }
  const Vec3 axis = (p[p.size() - 1] - p[p.size() - 2]).normalized();
  add_ring(p.back() - kEndInset * radius * axis, axis,
           radius * std::sqrt(1 - (1 - kEndInset) * (1 - kEndInset)), before);
  const auto last = first_landmark + static_cast<std::uint32_t>(p.size()) - 1;
  rings_.back().landmark = {last, last};
  rings_.back().weight = {1, 0};
  for (std::size_t k = first_ring; k < rings_.size();
       ++k) {  // cores by the shaft's own radius: end rings are narrower
    const double area = 2 * std::numbers::pi * radius / kPoints * spacing_[k];
    rings_[k].core = PointCore::of_surface(kCore * kCore * area / 2);
  }
  normalize(first_ring, first_landmark, p.size());
}

void NeedleRings::add_ring(const Vec3& centre, const Vec3& axis, double radius, double spacing) {
  Ring ring;
  ring.centre = centre;
  ring.axis = axis;
  ring.radius = radius;
  ring.first = static_cast<std::uint32_t>(points_.size());
  ring.count = kPoints;
  const Vec3 e = axis.cross(std::abs(axis.y()) < 0.9 ? Vec3::UnitY() : Vec3::UnitX()).normalized();
  const Vec3 f = axis.cross(e);
  const double turn = rings_.size() % 2 ? 0.5 : 0;
  for (std::size_t k = 0; k < kPoints; ++k) {
    const double angle = 2 * std::numbers::pi * (static_cast<double>(k) + turn) / kPoints;
    points_.push_back(centre + radius * (std::cos(angle) * e + std::sin(angle) * f));
  }
  rings_.push_back(ring);
  spacing_.push_back(spacing);
}

void NeedleRings::normalize(std::size_t first_ring, std::uint32_t first_landmark, std::size_t landmarks) {
  // A landmark's rings are neighbours, so one pass with a running window would do; shafts are short.
  for (std::size_t l = 0; l < landmarks; ++l) {
    const auto landmark = first_landmark + static_cast<std::uint32_t>(l);
    double sum = 0;
    const auto each = [&](auto&& visit) {
      for (std::size_t k = first_ring; k < rings_.size(); ++k)
        for (std::size_t side = 0; side < 2; ++side)
          if (rings_[k].landmark[side] == landmark && rings_[k].weight[side] > 0)
            visit(k, rings_[k].weight[side]);
    };
    each([&](std::size_t k, double& w) { sum += w *= spacing_[k]; });
    each([&](std::size_t, double& w) { w /= sum; });
  }
}

void NeedleRings::add_to(PointGroups& groups, std::uint32_t landmark) const {
  for (const Ring& ring : rings_)
    for (std::size_t side = 0; side < 2; ++side)
      if (ring.landmark[side] == landmark && ring.weight[side] > 0)
        for (const Vec3& p : points(ring))
          groups.add(p, ring.core, ring.weight[side] / static_cast<double>(ring.count));
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
