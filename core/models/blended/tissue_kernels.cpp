#include "core/models/blended/tissue_kernels.h"

namespace brachy {

double ScalarKernels::value(std::size_t m, const Vec3& x) const {
  const double r = x.norm() / supports[m];
  return std::visit([&](auto kernel) { return kernel.value(r); }, psi);
}

Mat3 ScalarKernels::gradient(std::size_t m, const Vec3& x, const Vec3& f) const {
  const double r = x.norm() / supports[m];
  if (!(r < 1)) return Mat3::Zero();
  const double slope = std::visit([&](auto kernel) { return kernel.derivative_over_r(r); }, psi);
  return slope / (supports[m] * supports[m]) * f * x.transpose();
}

}  // namespace brachy
