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

GridView DistanceGrid::view() const noexcept {
  GridView view;
  view.outside = outside_;
  if (values_.empty()) return view;
  view.values = values_.data();
  view.per_mm = static_cast<float>(1 / spacing_);
  for (std::size_t k = 0; k < 3; ++k) {
    view.least[k] = static_cast<float>(least_[static_cast<Eigen::Index>(k)]);
    view.counts[k] = static_cast<std::int32_t>(counts_[k]);
  }
  return view;
}

}  // namespace brachy
