#include "core/ladder/smooth_field.h"

#include <algorithm>

namespace brachy {

SmoothField::SmoothField(const Tissue& tissue, const ElasticKernel& kernel, SimdTarget target,
                         std::size_t max_landmarks)
    : table_(tissue, kernel, kernel.body().regions.empty() ? kSmoothSpacing : kRegionSpacing, target),
      columns_(kernel, table_, target, max_landmarks),
      loops_(near_loops(target)),
      node_field_(table_.field_size(), 0) {
  grid_points_.reserve(tissue.blocks.size() * Tissue::kBlockSize);
  for (const Block& block : tissue.blocks)
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i)
      grid_points_.push_back(table_.locate(tissue.rest_vertices[block.first + (i < block.count ? i : 0)]));
}

void SmoothField::set_forces(std::span<const Vec3> forces) noexcept {
  std::ranges::fill(node_field_, 0.0f);
  columns_.add_fields(forces, node_field_.data());
}

void SmoothField::interpolate(std::uint32_t b, BlockDisplacement<float>& u) const noexcept {
  loops_.interpolate(node_field_.data(), table_.row(), table_.slice(), &grid_points_[b * Tissue::kBlockSize],
                     Tissue::kBlockSize, u);
}

void SmoothField::add_displacement_at(const Vec3& X, Vec3& u) const noexcept {
  const GridPoint p = table_.locate(X);
  for (std::size_t z = 0; z < 4; ++z)
    for (std::size_t y = 0; y < 4; ++y)
      for (std::size_t x = 0; x < 4; ++x) {
        const float* v = &node_field_[3 * std::size_t{table_.node(p, x, y, z)}];
        u += static_cast<double>(p.wx[x] * p.wy[y] * p.wz[z]) * Vec3(v[0], v[1], v[2]);
      }
}

std::size_t SmoothField::bytes() const {
  return table_.bytes() + columns_.bytes() + grid_points_.size() * sizeof(GridPoint);
}

}  // namespace brachy
