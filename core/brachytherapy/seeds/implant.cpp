#include "core/brachytherapy/seeds/implant.h"

#include "core/base/error.h"
#include "core/brachytherapy/seeds/material_point.h"

#include <Eigen/LU>

namespace brachy {
namespace {

// To either side: the difference that gives a seed's direction. Well above what floats resolve (displacements_at), well
// below a needle's radius, within which the field varies.
constexpr double kAlongMm = 0.05;

bool is_found(Inversion result) {
  return result == Inversion::kFound || result == Inversion::kAmbiguous;
}

// Moves the seed to where the field takes its middle and, for its direction, the points kAlongMm before and behind it;
// true if it moved. To both sides: a field may have a cusp at its landmark.
bool carry(Seed& seed, const Vec3& u, const Vec3& u_before, const Vec3& u_behind) {
  const Vec3 turned = 0.5 * (u_before - u_behind);
  const Vec3 position = seed.rest + u;
  const Vec3 axis = turned.isZero(0) ? seed.rest_axis : (kAlongMm * seed.rest_axis + turned).normalized();
  if (position == seed.position && axis == seed.axis) return false;
  seed.position = position;
  seed.axis = axis;
  return true;
}

}  // namespace

Implant::Implant(std::size_t max_count) : max_count_(max_count) {
  seeds_.reserve(max_count);
  changed_.reserve(max_count);
  X_.reserve(kPointsOfSeed * max_count);
  u_.resize(kPointsOfSeed * max_count);
}

void Implant::restore(std::span<const Seed> seeds) {
  if (seeds.size() > max_count_)
    throw UserError("the body has " + std::to_string(seeds.size()) + " seeds, the scene allows " +
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
    const Vec3 along = kAlongMm * seed.rest_axis;
    carry(seed, place.field.displacement_at(seed.rest), place.field.displacement_at(seed.rest + along),
          place.field.displacement_at(seed.rest - along));
  }
  seeds_.push_back(seed);
  changed_.push_back(seed.tick);
  return DropRefusal::kNone;
}

void Implant::move(std::uint64_t tick, DisplacementField& field) noexcept {
  X_.clear();
  for (const Seed& seed : seeds_) {
    if (seed.is_fixed) continue;
    const Vec3 along = kAlongMm * seed.rest_axis;
    for (const Vec3& X : {seed.rest, Vec3(seed.rest + along), Vec3(seed.rest - along)}) X_.push_back(X);
  }
  field.displacements_at(X_, {u_.data(), X_.size()});
  const Vec3* u = u_.data();
  for (std::size_t i = 0; i < seeds_.size(); ++i) {
    if (seeds_[i].is_fixed) continue;
    if (carry(seeds_[i], u[0], u[1], u[2])) changed_[i] = tick;
    u += kPointsOfSeed;
  }
}

}  // namespace brachy
