#include "core/geometry/volume/volume.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace brachy {

Volume::Volume(const VoxelGrid& grid, std::vector<float> values)
    : grid_(grid), to_index_(grid.steps.inverse()), values_(std::move(values)) {
  assert(values_.size() == grid_.count() && !values_.empty());
}

bool Volume::contains(const Vec3& X) const noexcept {
  return steps_inside(X) >= -0.5;
}

double Volume::steps_inside(const Vec3& X) const noexcept {
  const Vec3 index = index_of(X);
  double least = 1e30;
  for (int k = 0; k < 3; ++k) {
    const auto last = static_cast<double>(grid_.size[static_cast<std::size_t>(k)] - 1);
    least = std::min({least, index[k], last - index[k]});
  }
  return least;
}

Vec3 Volume::clamped_index(const Vec3& X) const noexcept {
  Vec3 index = index_of(X);
  for (int k = 0; k < 3; ++k) {
    const auto last = static_cast<double>(grid_.size[static_cast<std::size_t>(k)] - 1);
    // Also where it is not a number.
    index[k] = index[k] > 0 ? std::min(index[k], last) : 0;
  }
  return index;
}

float Volume::at(const Vec3& X) const noexcept {
  const Vec3 index = clamped_index(X);
  std::size_t first[3], step[3];
  float t[3];
  std::size_t stride = 1, base = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double at = index[static_cast<Eigen::Index>(k)];
    first[k] = static_cast<std::size_t>(at);
    t[k] = static_cast<float>(at - static_cast<double>(first[k]));
    step[k] = first[k] + 1 < grid_.size[k] ? stride : 0;
    base += first[k] * stride;
    stride *= grid_.size[k];
  }
  const float* v = &values_[base];
  const auto along = [&](const float* p) { return p[0] + t[0] * (p[step[0]] - p[0]); };
  const auto across = [&](const float* p) {
    const float a = along(p);
    return a + t[1] * (along(p + step[1]) - a);
  };
  const float a = across(v);
  return a + t[2] * (across(v + step[2]) - a);
}

float Volume::nearest(const Vec3& X) const noexcept {
  const Vec3 index = clamped_index(X);
  const auto whole = [&](int k) { return static_cast<std::size_t>(std::lround(index[k])); };
  return value(whole(0), whole(1), whole(2));
}

Volume Volume::coarsened(double step_mm) const {
  VoxelGrid coarse = grid_;
  std::array<std::size_t, 3> group{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double step = grid_.steps.col(axis).norm();
    group[k] = std::clamp(static_cast<std::size_t>(step_mm / step), std::size_t{1}, grid_.size[k]);
    coarse.size[k] = grid_.size[k] / group[k];
    const auto count = static_cast<double>(group[k]);
    coarse.origin += 0.5 * (count - 1) * grid_.steps.col(axis);
    coarse.steps.col(axis) *= count;
  }
  std::vector<double> sums(coarse.count());
  std::vector<float> counts(coarse.count());
  std::size_t from = 0;
  for (std::size_t k = 0; k < grid_.size[2]; ++k)
    for (std::size_t j = 0; j < grid_.size[1]; ++j)
      for (std::size_t i = 0; i < grid_.size[0]; ++i, ++from) {
        const std::size_t x = std::min(i / group[0], coarse.size[0] - 1),
                          y = std::min(j / group[1], coarse.size[1] - 1),
                          z = std::min(k / group[2], coarse.size[2] - 1);
        const std::size_t to = x + coarse.size[0] * (y + coarse.size[1] * z);
        sums[to] += static_cast<double>(values_[from]);
        counts[to] += 1;
      }
  std::vector<float> means(coarse.count());
  for (std::size_t n = 0; n < means.size(); ++n)
    means[n] = static_cast<float>(sums[n] / static_cast<double>(counts[n]));
  return {coarse, std::move(means)};
}

}  // namespace brachy
