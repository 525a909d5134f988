#include "apps/study/comparators/compared_model.h"

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

}  // namespace brachy
