#pragma once

#include <vector>

#include "core/base/rigid_transform.h"
#include "core/elasticity/compact/compact_kernel.h"

namespace brachy {

/// How large ∇(C f) and its second derivatives are from a distance on, for a unit force f: nonincreasing bounds in
/// nuclear norm, sampled from the kernels' own gradients at construction, which takes some milliseconds.
class NearBounds {
 public:
  struct At {
    double slope = 0;      ///< |∇(C f)|₁
    double squeeze = 0;    ///< no eigenvalue of its symmetric part is below minus this
    double curvature = 0;  ///< Σ_k |∂²∇(C f)/∂x_k²|₁, 1/mm²
  };

  /// Of Kelvin's solution for shear modulus 1.
  explicit NearBounds(double poisson);
  /// Of the kernel times `scale`.
  NearBounds(const CompactKernel& kernel, double scale);

  /// At `distance` mm and beyond; `s` as in kelvin.h, mm², not used by compact kernels.
  At at(double distance, double s) const {
    if (bounds_.empty()) {
      const double inverse = 1 / (distance * distance + s);
      return {kelvin_.slope * inverse, kelvin_.squeeze * inverse, kelvin_.curvature * inverse * inverse};
    }
    const auto bin = static_cast<std::size_t>(distance * bins_per_mm_);
    return bounds_[bin < bounds_.size() ? bin : bounds_.size() - 1];
  }
  /// Where the slope is greatest, mm.
  double steepest(double s) const { return bounds_.empty() ? steepest_ * std::sqrt(s) : steepest_; }

 private:
  At kelvin_;  // times powers of r² + s
  double bins_per_mm_ = 0, steepest_ = 0;
  std::vector<At> bounds_;  // of the compact kernel
};

}  // namespace brachy
