#include "apps/lab/comparators/compared_model.h"

#include <algorithm>
#include <stdexcept>

namespace brachy {

std::vector<double> ComparedModel::jacobians(std::span<const Vec3> X) const {
  constexpr double kHalf = 1e-3;  // mm
  std::vector<Vec3> around;
  around.reserve(6 * X.size());
  for (const Vec3& x : X)
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      around.push_back(x + kHalf * Vec3::Unit(axis));
      around.push_back(x - kHalf * Vec3::Unit(axis));
    }
  const std::vector<Vec3> u = displacements_at(around);
  std::vector<double> det;
  det.reserve(X.size());
  for (std::size_t i = 0; i < X.size(); ++i) {
    Mat3 F = Mat3::Identity();
    for (std::size_t axis = 0; axis < 3; ++axis)
      F.col(static_cast<Eigen::Index>(axis)) += (u[6 * i + 2 * axis] - u[6 * i + 2 * axis + 1]) / (2 * kHalf);
    det.push_back(F.determinant());
  }
  return det;
}

int come_to_rest(ComparedModel& model, std::span<const Vec3> displacements, double at_rest_mm,
                 std::span<Vec3> u) {
  constexpr int kMostTicks = 400;
  std::vector<Vec3> before(u.size());
  model.read(before);
  for (int ticks = 1; ticks < kMostTicks; ++ticks) {
    model.tick(displacements);
    model.read(u);
    double moved = 0;
    for (std::size_t i = 0; i < u.size(); ++i) moved = std::max(moved, (u[i] - before[i]).norm());
    if (moved <= at_rest_mm) return ticks;
    std::ranges::copy(u, before.begin());
  }
  throw std::runtime_error("does not come to rest");
}

}  // namespace brachy
