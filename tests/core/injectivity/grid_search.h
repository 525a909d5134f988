#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/injectivity/scalar_cells.h"

namespace brachy::test {

/// The least det(I + ∇u) on a grid of 0.25 mm over all that `field` reaches; 1 where it cannot be below 0 because
/// Σ|w| max|ψ′|/a < 1. Brute force, independent of the certificate's bounds.
inline double least_on_grid(const RbfField& field, const ScalarCells& cells) {
  constexpr double kCube = 4, kSpacing = 0.25;
  const double a = field.support_radius, steepest = max_slope(field.kernel) / a;
  Vec3 min = field.positions.front(), max = min;
  for (const Vec3& p : field.positions) {
    min = min.cwiseMin(p);
    max = max.cwiseMax(p);
  }
  double least = 1;
  const auto visit_cube = [&](const Vec3& corner) {
    const Cell cell{corner + Vec3::Constant(kCube / 2), kCube / 2};
    std::vector<std::uint32_t> near;
    double slope = 0;
    for (std::uint32_t i = 0; i < field.positions.size(); ++i) {
      if (cell.squared_distance(field.positions[i]) >= a * a) continue;
      near.push_back(i);
      slope += steepest * field.weights[i].norm();
    }
    if (slope < 1) return;
    CellPoints X{};
    CellGradients A;
    alignas(64) float det[CellPoints::kCount];
    constexpr int kSide = static_cast<int>(kCube / kSpacing);
    for (int z = 0; z < kSide; ++z)
      for (int y = 0; y < kSide; y += 2) {  // two rows of 16 at a time
        for (int i = 0; i < 32; ++i) {
          X.x[i] = static_cast<float>(kSpacing * (i % kSide) - kCube / 2);
          X.y[i] = static_cast<float>(kSpacing * (y + i / kSide) - kCube / 2);
          X.z[i] = static_cast<float>(kSpacing * z - kCube / 2);
        }
        cells.gradients(cell, near, CellBounds{}, X, A);
        cells.loops().determinants(A, 1, det);
        const float* lowest = std::min_element(det, det + 32);
        if (static_cast<double>(*lowest) >= least) continue;
        const auto i = static_cast<std::size_t>(lowest - det);
        const Vec3 point = cell.centre + Eigen::Vector3f(X.x[i], X.y[i], X.z[i]).cast<double>();
        least = std::min(least, field.jacobian(point));
      }
  };
  for (double z = min.z() - a; z < max.z() + a; z += kCube)
    for (double y = min.y() - a; y < max.y() + a; y += kCube)
      for (double x = min.x() - a; x < max.x() + a; x += kCube) visit_cube({x, y, z});
  return least;
}

}  // namespace brachy::test
