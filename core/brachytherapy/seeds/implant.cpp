#include "core/brachytherapy/seeds/implant.h"

#include "core/base/error.h"
#include "core/brachytherapy/seeds/material_point.h"

#include <Eigen/LU>

namespace brachy {
namespace {

constexpr double kAlong = 1e-3;  // mm, to either side: the difference that gives a seed's direction

bool is_found(Inversion result) {
  return result == Inversion::kFound || result == Inversion::kAmbiguous;
}

// Moves the seed with the field; true if it moved.
bool carry(Seed& seed, const DisplacementField& field) {
  if (seed.is_fixed) return false;
  const Vec3 u = field.displacement_at(seed.rest);
  const Vec3 half = kAlong * seed.rest_axis;  // to both sides: a field may have a cusp at its landmark
  const Vec3 turned =
      0.5 * (field.displacement_at(seed.rest + half) - field.displacement_at(seed.rest - half));
  const Vec3 position = seed.rest + u;
  const Vec3 axis = turned.isZero(0) ? seed.rest_axis : (half + turned).normalized();
  if (position == seed.position && axis == seed.axis) return false;
  seed.position = position;
  seed.axis = axis;
  return true;
}

}  // namespace

Implant::Implant(std::size_t max_count) : max_count_(max_count) {
  seeds_.reserve(max_count);
  changed_.reserve(max_count);
}

void Implant::restore(std::span<const Seed> seeds) {
  if (seeds.size() > max_count_)
    throw UserError("the session has " + std::to_string(seeds.size()) + " seeds, the scene allows " +
                    std::to_string(max_count_) + "; raise seeds.max_count");
  seeds_.assign(seeds.begin(), seeds.end());
  changed_.assign(seeds.size(), 0);
}

DropRefusal Implant::drop(Seed seed, const Place& place) noexcept {
  if (seeds_.size() == max_count_) return DropRefusal::kFull;
  const MaterialPoint point =
      find_material_point(place.field, place.verdict, seed.dropped, place.material_tip);
  if (!is_found(point.result) && place.is_needle_in)
    return point.result == Inversion::kFolded ? DropRefusal::kFolded : DropRefusal::kNotConverged;
  seed.id = static_cast<std::uint32_t>(seeds_.size() + 1);
  seed.is_certified = place.verdict == Verdict::kInjective;
  seed.is_fixed = !is_found(point.result) || !place.tissue.inside(point.X);
  if (seed.is_fixed) {
    seed.is_certified = false;  // no material point
    seed.rest = seed.position = seed.dropped;
    seed.rest_axis = seed.axis = seed.dropped_axis;
  } else {
    seed.rest = point.X;
    seed.rest_axis = (point.F.inverse() * seed.dropped_axis).normalized();
    carry(seed, place.field);
  }
  seeds_.push_back(seed);
  changed_.push_back(seed.tick);
  return DropRefusal::kNone;
}

void Implant::move(std::uint64_t tick, const DisplacementField& field) noexcept {
  for (std::size_t i = 0; i < seeds_.size(); ++i)
    if (carry(seeds_[i], field)) changed_[i] = tick;
}

}  // namespace brachy
