#include "core/models/matrix_kernel/smooth_tables.h"

#include "core/elasticity/elastic_kernel.h"

namespace brachy {

SmoothTables::SmoothTables(const Tissue& tissue, const ElasticKernel& kernel, SimdTarget target,
                           const SetUp& set_up)
    : remainder(tissue, kernel, kernel.body().regions.empty() ? kSmoothSpacing : kRegionSpacing, target,
                set_up) {
  for (const Block& block : tissue.blocks) add_block(tissue, block);
}

void SmoothTables::add_block(const Tissue& tissue, const Block& block) {
  // Of the table's spacing: what a cubic bends beyond a parabola is then a hundredth of the table's own error.
  constexpr double kSmall = 0.6;
  const Vec3 middle = 0.5 * (block.min + block.max), half = (0.5 * (block.max - block.min)).cwiseMax(1e-3);
  BlockReading reading{.first = grid_points.size(), .half = half.cast<float>()};
  const double spacing = remainder.planes(0)[1] - remainder.planes(0)[0];
  reading.is_parabola = !remainder.is_linear() && half.maxCoeff() < kSmall * spacing;
  if (reading.is_parabola) {
    const auto add = [&](double x, double y, double z) {
      grid_points.push_back(remainder.locate(middle + Vec3(x, y, z).cwiseProduct(half)));
    };
    add(0, 0, 0);
    for (int k = 0; k < 3; ++k) {
      const Vec3 e = Vec3::Unit(k);
      add(e.x(), e.y(), e.z());
      add(-e.x(), -e.y(), -e.z());
    }
    add(1, 1, 0);
    add(0, 1, 1);
    add(1, 0, 1);
  } else {
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i)
      grid_points.push_back(remainder.locate(tissue.rest_vertices[block.first + (i < block.count ? i : 0)]));
  }
  blocks.push_back(reading);
}

std::shared_ptr<const SmoothTables> make_smooth_tables(const Tissue& tissue, const MatrixKernel& kernel,
                                                       SimdTarget target, const SetUp& set_up) {
  const auto* elastic = dynamic_cast<const ElasticKernel*>(&kernel);
  return elastic ? std::make_shared<const SmoothTables>(tissue, *elastic, target, set_up) : nullptr;
}

}  // namespace brachy
