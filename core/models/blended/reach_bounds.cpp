#include "core/models/blended/reach_bounds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/injectivity/kernel_bounds.h"
#include "core/models/matrix_kernel/near_bounds.h"

namespace brachy {

ReachBounds::ReachBounds(const ScalarKernels& kernels, std::size_t tissue)
    : bins_per_mm_(kBins / kernels.supports[tissue]) {
  const double a = kernels.supports[tissue];
  const KernelBounds bounds(kernels.psi);
  for (std::size_t k = 0; k < kBins; ++k) {
    const double r = static_cast<double>(k) / kBins;
    bins_[k][0] = std::visit([&](auto psi) { return psi.value(r); }, kernels.psi);  // it falls with r
    bins_[k][1] = bounds.slope(r) / a;
    bins_[k][3] = std::min(bounds.third(r) / (a * a * a), kUnknown);
    const auto slope_at = [&](double q) {
      return std::visit([&](auto psi) { return std::abs(psi.derivative(q)); }, kernels.psi);
    };
    if (const double q = r + 0.5 / kBins; slope_at(q) > slope_at(steepest_ / a)) steepest_ = q * a;
  }
  // ψ″ = h + r h′ with h = ψ′/r.
  constexpr double kEnd = 1 - 1e-9;
  const double second = std::visit(
      [](auto psi) { return psi.derivative_over_r(kEnd) + psi.over_r_derivatives(kEnd)[0]; }, kernels.psi);
  kink_ = std::abs(second) > 1e-6 ? std::abs(second) / (a * a) : 0;
  integrate_second(1);
}

ReachBounds::ReachBounds(const CompactKernels& kernels, std::size_t tissue)
    : bins_per_mm_(kBins / kernels.support(tissue)) {
  const CompactKernel& kernel = kernels.kernels[tissue];
  const NearBounds bounds(kernel, 1);
  steepest_ = bounds.steepest(0);
  for (std::size_t k = kBins; k-- > 0;) {
    const double distance = static_cast<double>(k) / bins_per_mm_;
    const NearBounds::At at = bounds.at(distance);
    const Mat3 C = kernel.value({distance, 0, 0});
    // |C f| changes by its slope on the way to the next bin at most.
    const double largest = std::max(std::abs(C(0, 0)), std::abs(C(1, 1))) + at.slope / bins_per_mm_;
    bins_[k] = {std::max(bins_[k + 1][0], largest), at.slope, 0, at.curvature / 3};
  }
  integrate_second(std::numbers::sqrt2);
}

// Outward along the line from the landmark everything ends at 0: ∇∂_v is at most the integral of |∇∂_v∂_r| on
// the way, which is √2 of the largest |∇∂_v²| at most (polarization), and no more than that for a symmetric
// form (Banach).
void ReachBounds::integrate_second(double share) {
  for (std::size_t k = kBins; k-- > 0;)
    bins_[k][2] = std::min(bins_[k + 1][2] + share * bins_[k][3] / bins_per_mm_, kUnknown);
}

}  // namespace brachy
