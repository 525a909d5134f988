#include "core/solve/rbf_field.h"

namespace brachy {

Vec3 RbfField::displacement(const Vec3& X) const {
  return std::visit(
      [&](auto kernel_functor) {
        Vec3 u = Vec3::Zero();
        for (std::size_t i = 0; i < positions.size(); ++i) {
          const double r = (X - positions[i]).norm() / support_radius;
          if (r < 1) u += kernel_functor.value(r) * weights[i];
        }
        return u;
      },
      kernel);
}

Mat3 RbfField::deformation_gradient(const Vec3& X) const {
  return std::visit(
      [&](auto kernel_functor) {
        Mat3 F = Mat3::Identity();
        for (std::size_t i = 0; i < positions.size(); ++i) {
          const Vec3 x = (X - positions[i]) / support_radius;
          const double r = x.norm();
          if (r < 1) F += kernel_functor.derivative_over_r(r) / support_radius * weights[i] * x.transpose();
        }
        return F;
      },
      kernel);
}

}  // namespace brachy
