#include "core/ultrasound/distance_grid.h"

#include <algorithm>
#include <cmath>

namespace brachy {

DistanceGrid::DistanceGrid(const SurfaceBvh& surface, double spacing_mm, double margin_mm)
    : least_(surface.min() - Vec3::Constant(margin_mm)),
      spacing_(spacing_mm),
      outside_(static_cast<float>(margin_mm)) {
  const Vec3 size = surface.max() + Vec3::Constant(margin_mm) - least_;
  for (int k = 0; k < 3; ++k) counts_[k] = static_cast<std::size_t>(std::ceil(size[k] / spacing_)) + 1;
  values_.reserve(counts_[0] * counts_[1] * counts_[2]);
  for (std::size_t z = 0; z < counts_[2]; ++z)
    for (std::size_t y = 0; y < counts_[1]; ++y)
      for (std::size_t x = 0; x < counts_[0]; ++x) {
        const Vec3 X =
            least_ + spacing_ * Vec3(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
        const double distance = surface.closest_point(X).signed_distance;
        values_.push_back(static_cast<float>(std::min(distance, margin_mm)));
      }
}

float DistanceGrid::at(const Vec3& X) const noexcept {
  if (values_.empty()) return outside_;
  std::size_t first[3];
  float t[3];
  for (int k = 0; k < 3; ++k) {
    const double x = (X[k] - least_[k]) / spacing_;
    if (!(x >= 0 && x < static_cast<double>(counts_[k] - 1))) return outside_;
    first[k] = static_cast<std::size_t>(x);
    t[k] = static_cast<float>(x - static_cast<double>(first[k]));
  }
  const std::size_t row = counts_[0], slice = counts_[0] * counts_[1];
  const float* v = &values_[first[0] + first[1] * row + first[2] * slice];
  const auto along = [&](const float* p) { return p[0] + t[0] * (p[1] - p[0]); };
  const auto across = [&](const float* p) {
    const float a = along(p);
    return a + t[1] * (along(p + row) - a);
  };
  const float a = across(v);
  return a + t[2] * (across(v + slice) - a);
}

}  // namespace brachy
