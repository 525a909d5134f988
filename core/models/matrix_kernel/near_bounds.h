#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/elasticity/compact/compact_kernel.h"
#include "core/models/matrix_kernel/near_loops.h"

namespace brachy {

/// How large ∇(C f) and its second derivatives are from a distance on, for a unit force f: nonincreasing bounds in
/// nuclear norm, sampled from the kernels' own gradients at construction, which takes some milliseconds.
class NearBounds {
 public:
  struct At {
    double slope = 0;      ///< |∇(C f)|₁
    double squeeze = 0;    ///< no eigenvalue of its symmetric part is below minus this
    double curvature = 0;  ///< Σ_k |∂²∇(C f)/∂x_k²|₁, 1/mm²
    double shrink = std::numeric_limits<double>::infinity();  ///< its divergence is not below minus this
  };

  /// Of Kelvin's solution for shear modulus 1.
  explicit NearBounds(double poisson);
  /// Of the kernel times `scale`.
  NearBounds(const CompactKernel& kernel, double scale);

  /// Of the compact kernel, at `distance` mm and beyond.
  At at(double distance) const {
    const auto bin = static_cast<std::size_t>(distance * bins_per_mm_);
    return bounds_[bin < bounds_.size() ? bin : bounds_.size() - 1];
  }
  bool is_kelvin() const { return bounds_.empty(); }
  /// Of Kelvin's solution, for the loops over forces (near_loops.h), which know the angle to each.
  KelvinBounds kelvin() const;
  /// Where the slope is greatest, mm.
  double steepest(double s) const { return bounds_.empty() ? steepest_ * std::sqrt(s) : steepest_; }

 private:
  At kelvin_, correction_;                         // times powers of r² + s
  double kelvin_shrink_ = 0, kelvin_stretch_ = 0;  // (1 − 2b)/4π, b/4π
  double bins_per_mm_ = 0, steepest_ = 0;
  std::vector<At> bounds_;  // of the compact kernel
};

}  // namespace brachy
