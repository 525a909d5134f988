#include "core/dose/dose_grid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/dose/dose_loops.h"
#include "core/error.h"

namespace brachy {

DoseGrid::DoseGrid(const Vec3& min, const Vec3& max, double spacing_mm, SimdTarget target)
    : origin_(min), spacing_(spacing_mm), size_{}, target_(target) {
  assert(spacing_mm > 0 && (max - min).minCoeff() >= 0);
  double points = 1;
  for (int k = 0; k < 3; ++k) {
    const double steps = std::ceil((max[k] - min[k]) / spacing_mm - 1e-9);  // a rounding is no further point
    points *= steps + 1;
    size_[static_cast<std::size_t>(k)] = static_cast<std::size_t>(std::min(steps, 1e9)) + 1;
  }
  if (!(points <= static_cast<double>(kMaxPoints)))
    throw UserError("a dose grid of " + std::to_string(spacing_mm) + " mm would have " +
                    std::to_string(points) + " points, more than " + std::to_string(kMaxPoints) +
                    "; take a larger spacing");
  dose_.resize(size_[0] * size_[1] * size_[2]);
}

Vec3 DoseGrid::position(std::size_t i, std::size_t j, std::size_t k) const {
  return origin_ + spacing_ * Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
}

void DoseGrid::add(const DoseSeed& seed) {
  assert(seed.position.allFinite() && std::abs(seed.axis.norm() - 1) < 1e-6);
  const DoseTables& tables = dose_tables(seed.source);
  const DoseLoops& loops = dose_loops(target_);
  const Vec3 away_step = spacing_ * seed.axis.cross(Vec3::UnitX());
  DoseRow row{
      .along = 0, .along_step = static_cast<float>(spacing_ * seed.axis.x()), .away = {}, .away_step = {}};
  for (int c = 0; c < 3; ++c) row.away_step[c] = static_cast<float>(away_step[c]);
  for (std::size_t k = 0; k < size_[2]; ++k)
    for (std::size_t j = 0; j < size_[1]; ++j) {
      const Vec3 d = position(0, j, k) - seed.position, away = seed.axis.cross(d);
      row.along = static_cast<float>(seed.axis.dot(d));
      for (int c = 0; c < 3; ++c) row.away[c] = static_cast<float>(away[c]);
      loops.add_row(tables, row, static_cast<float>(seed.air_kerma_strength_u), size_[0],
                    &dose_[index(0, j, k)]);
    }
}

void DoseGrid::clear() {
  std::fill(dose_.begin(), dose_.end(), 0.0f);
}

double DoseGrid::at(const Vec3& p) const {
  std::array<std::size_t, 3> cell{};
  std::array<double, 3> share{};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto axis = static_cast<Eigen::Index>(c);
    const double v = (p[axis] - origin_[axis]) / spacing_, last = static_cast<double>(size_[c] - 1);
    if (!(v >= 0 && v <= last)) return std::numeric_limits<double>::quiet_NaN();
    cell[c] = std::min(static_cast<std::size_t>(v), size_[c] < 2 ? 0 : size_[c] - 2);
    share[c] = v - static_cast<double>(cell[c]);
  }
  double sum = 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::array<std::size_t, 3> at = cell;
    for (std::size_t c = 0; c < 3; ++c) {
      const bool upper = (corner >> c & 1) != 0;
      weight *= upper ? share[c] : 1 - share[c];
      at[c] = std::min(cell[c] + (upper ? 1 : 0), size_[c] - 1);
    }
    sum += weight * static_cast<double>(dose_[index(at[0], at[1], at[2])]);
  }
  return sum;
}

}  // namespace brachy
