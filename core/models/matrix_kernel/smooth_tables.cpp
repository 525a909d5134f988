#include "core/models/matrix_kernel/smooth_tables.h"

#include "core/elasticity/elastic_kernel.h"

namespace brachy {

SmoothTables::SmoothTables(const Tissue& tissue, const ElasticKernel& kernel, SimdTarget target)
    : remainder(tissue, kernel, kernel.body().regions.empty() ? kSmoothSpacing : kRegionSpacing, target) {
  grid_points.reserve(tissue.blocks.size() * Tissue::kBlockSize);
  for (const Block& block : tissue.blocks)
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i)
      grid_points.push_back(remainder.locate(tissue.rest_vertices[block.first + (i < block.count ? i : 0)]));
}

std::shared_ptr<const SmoothTables> make_smooth_tables(const Tissue& tissue, const MatrixKernel& kernel,
                                                       SimdTarget target) {
  const auto* elastic = dynamic_cast<const ElasticKernel*>(&kernel);
  return elastic ? std::make_shared<const SmoothTables>(tissue, *elastic, target) : nullptr;
}

}  // namespace brachy
