#include "core/brachytherapy/seeds/implant.h"

#include "core/base/error.h"
#include "core/brachytherapy/seeds/material_point.h"

#include <Eigen/LU>

namespace brachy {
namespace {

constexpr double kAlong = 1e-3;  // mm, to either side: the difference that gives a seed's direction

DropRefusal refusal_of(Inversion result) {
  switch (result) {
    case Inversion::kFound:
      return DropRefusal::kNone;
    case Inversion::kFolded:
      return DropRefusal::kFolded;
    case Inversion::kAmbiguous:
      return DropRefusal::kAmbiguous;
    case Inversion::kNotConverged:
      break;
  }
  return DropRefusal::kNotConverged;
}

// Moves the seed with the field; true if it moved.
bool carry(Seed& seed, const DisplacementField& field) {
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

DropRefusal Implant::drop(Seed seed, const DisplacementField& field, Verdict verdict,
                          const Vec3& material_tip) noexcept {
  if (seeds_.size() == max_count_) return DropRefusal::kFull;
  const MaterialPoint point = find_material_point(field, verdict, seed.dropped, material_tip);
  if (point.result != Inversion::kFound) return refusal_of(point.result);
  seed.id = static_cast<std::uint32_t>(seeds_.size() + 1);
  seed.is_certified = verdict == Verdict::kInjective;
  seed.rest = point.X;
  seed.rest_axis = (point.F.inverse() * seed.dropped_axis).normalized();
  carry(seed, field);
  seeds_.push_back(seed);
  changed_.push_back(seed.tick);
  return DropRefusal::kNone;
}

void Implant::move(std::uint64_t tick, const DisplacementField& field) noexcept {
  for (std::size_t i = 0; i < seeds_.size(); ++i)
    if (carry(seeds_[i], field)) changed_[i] = tick;
}

}  // namespace brachy
