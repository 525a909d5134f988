#include "core/models/matrix_kernel/smooth_cells.h"

#include <algorithm>

namespace brachy {

SmoothCells::SmoothCells(const Tissue& tissue, const SmoothField& smooth, SimdTarget target)
    : smooth_(smooth), loops_(cell_loops(target)), min_(tissue.rest_vertices.front()), max_(min_) {
  for (const Vec3& X : tissue.rest_vertices) {
    min_ = min_.cwiseMin(X);
    max_ = max_.cwiseMax(X);
  }
  domain_ = Cell::around(min_, max_);
}

std::size_t SmoothCells::narrow(const Cell& cell, std::span<const std::uint32_t> /*from*/, std::uint32_t* to,
                                CellBounds& bounds) const noexcept {
  bounds = {};
  if (((cell.centre - min_).array() < -cell.half).any() || ((cell.centre - max_).array() > cell.half).any())
    return 0;
  bounds.shrink = 0;
  smooth_.add_bounds(cell, bounds);
  to[0] = 0;
  return 1;
}

void SmoothCells::gradients(const Cell& cell, std::span<const std::uint32_t> /*sources*/,
                            const CellBounds& /*bounds*/, const CellPoints& X,
                            CellGradients& A) const noexcept {
  for (std::size_t i = 0; i < CellPoints::kCount; ++i) {
    const Mat3 G = smooth_.gradient_at(cell.centre + X.at(i));
    for (std::size_t k = 0; k < 9; ++k)
      A.a[k][i] = static_cast<float>(G(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)));
  }
}

}  // namespace brachy
