#include "core/brachytherapy/dose/dose_grid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_loops.h"

namespace brachy {
namespace {

/// Adds a seed's dose along rows of one direction.
class SeedRows {
 public:
  /// `axis` in place of the seed's own; `step` from one point to the next, mm.
  SeedRows(const DoseSeed& seed, const Vec3& axis, const Vec3& step, SimdTarget target)
      : tables_(dose_tables(seed.source)),
        loops_(dose_loops(target)),
        axis_(axis),
        strength_u_(static_cast<float>(seed.air_kerma_strength_u)) {
    const Vec3 away_step = axis.cross(step);
    row_.along_step = static_cast<float>(axis.dot(step));
    for (int c = 0; c < 3; ++c) row_.away_step[c] = static_cast<float>(away_step[c]);
  }
  /// `first`: from the seed to the row's first point, mm.
  void add(const Vec3& first, std::size_t count, float* dose) {
    const Vec3 away = axis_.cross(first);
    row_.along = static_cast<float>(axis_.dot(first));
    for (int c = 0; c < 3; ++c) row_.away[c] = static_cast<float>(away[c]);
    loops_.add_row(tables_, row_, strength_u_, count, dose);
  }

 private:
  const DoseTables& tables_;
  const DoseLoops& loops_;
  Vec3 axis_;
  float strength_u_;
  DoseRow row_{};
};

}  // namespace

std::vector<float> dose_at_voxels(std::span<const DoseSeed> seeds, const VoxelGrid& grid) {
  std::vector<float> dose(grid.count(), 0.0F);
  for (const DoseSeed& seed : seeds) {
    SeedRows rows(seed, seed.axis, grid.steps.col(0), best_simd_target());
    for (std::size_t k = 0; k < grid.size[2]; ++k)
      for (std::size_t j = 0; j < grid.size[1]; ++j) {
        const Vec3 first = grid.position(Vec3(0, static_cast<double>(j), static_cast<double>(k)));
        rows.add(first - seed.position, grid.size[0], &dose[grid.index(0, j, k)]);
      }
  }
  return dose;
}

DoseGrid::DoseGrid(const Vec3& min, const Vec3& max, double spacing_mm, SimdTarget target)
    : origin_(min), spacing_(spacing_mm), size_{}, target_(target) {
  assert(spacing_mm > 0 && (max - min).minCoeff() >= 0);
  double points = 1;
  for (int k = 0; k < 3; ++k) {
    const double steps = std::ceil((max[k] - min[k]) / spacing_mm - 1e-9);  // rounding must not add a point
    points *= steps + 1;
    size_[static_cast<std::size_t>(k)] = static_cast<std::size_t>(std::min(steps, 1e9)) + 1;
  }
  if (!(points <= static_cast<double>(kMaxPoints)))
    throw UserError("a dose grid of " + std::to_string(spacing_mm) + " mm would have " +
                    std::to_string(points) + " points, more than " + std::to_string(kMaxPoints) +
                    "; use a larger spacing");
  dose_.resize(size_[0] * size_[1] * size_[2]);
}

Vec3 DoseGrid::position(std::size_t i, std::size_t j, std::size_t k) const {
  return origin_ + spacing_ * Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
}

void DoseGrid::add(const DoseSeed& seed, const Vec3& stretch) {
  assert(seed.position.allFinite() && std::abs(seed.axis.norm() - 1) < 1e-6 && stretch.minCoeff() > 0);
  const Vec3 axis = stretch == Vec3::Ones() ? seed.axis : Vec3(stretch.cwiseProduct(seed.axis).normalized());
  SeedRows rows(seed, axis, stretch.x() * spacing_ * Vec3::UnitX(), target_);
  for (std::size_t k = 0; k < size_[2]; ++k)
    for (std::size_t j = 0; j < size_[1]; ++j)
      rows.add(stretch.cwiseProduct(position(0, j, k) - seed.position), size_[0], &dose_[index(0, j, k)]);
}

void DoseGrid::clear() {
  std::fill(dose_.begin(), dose_.end(), 0.0f);
}

double DoseGrid::at(const Vec3& p) const {
  std::array<std::size_t, 3> cell{}, step{};
  std::array<float, 3> share{};
  const std::array<std::size_t, 3> strides = {1, size_[0], size_[0] * size_[1]};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto axis = static_cast<Eigen::Index>(c);
    const double v = (p[axis] - origin_[axis]) / spacing_, last = static_cast<double>(size_[c] - 1);
    if (!(v >= -0.5 && v <= last + 0.5)) return std::numeric_limits<double>::quiet_NaN();
    const double inside = std::clamp(v, 0.0, last);
    cell[c] = std::min(static_cast<std::size_t>(inside), size_[c] < 2 ? 0 : size_[c] - 2);
    share[c] = static_cast<float>(inside - static_cast<double>(cell[c]));
    step[c] = size_[c] < 2 ? 0 : strides[c];
  }
  const float* dose = &dose_[index(cell[0], cell[1], cell[2])];
  if (*dose == 0) return 0;  // no seed yet: a seed's dose reaches every point
  // Corner by corner, x fastest; in loops of eight, which the compiler vectorises.
  std::array<float, 8> weight, gy, part;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    weight[corner] = ((corner & 1) ? share[0] : 1 - share[0]) * ((corner & 2) ? share[1] : 1 - share[1]) *
                     ((corner & 4) ? share[2] : 1 - share[2]);
    gy[corner] =
        dose[((corner & 1) ? step[0] : 0) + ((corner & 2) ? step[1] : 0) + ((corner & 4) ? step[2] : 0)];
  }
  // Where a seed was taken out again rounding may leave less than nothing.
  constexpr float kLeastGy = 1e-12F;
  for (std::size_t corner = 0; corner < 8; ++corner)
    part[corner] = weight[corner] / std::sqrt(std::max(gy[corner], kLeastGy));
  const double sum = static_cast<double>(((part[0] + part[1]) + (part[2] + part[3])) +
                                         ((part[4] + part[5]) + (part[6] + part[7])));
  return 1 / (sum * sum);
}

}  // namespace brachy
