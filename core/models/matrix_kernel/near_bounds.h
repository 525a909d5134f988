#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
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

  /// At `distance` mm and beyond; `s` as in kelvin.h, mm², not used by compact kernels.
  At at(double distance, double s) const {
    if (bounds_.empty()) {
      const double inverse = 1 / (distance * distance + s);
      return {kelvin_.slope * inverse, kelvin_.squeeze * inverse, kelvin_.curvature * inverse * inverse};
    }
    const auto bin = static_cast<std::size_t>(distance * bins_per_mm_);
    return bounds_[bin < bounds_.size() ? bin : bounds_.size() - 1];
  }
  /// The same where the cosine of the angle from the force to the place is at least `behind` and at most `ahead`.
  At at(double distance, double s, double behind, double ahead) const {
    At bounds = at(distance, s);
    if (!bounds_.empty()) return bounds;
    const double inverse = 1 / (distance * distance + s), spread = 1.5 * s * inverse;
    const double steepest = std::max(ahead, -behind);
    bounds.shrink = kelvin_shrink_ * (1 + spread) * steepest * inverse;
    const double skew = 0.5 * (kelvin_shrink_ + spread / (4 * std::numbers::pi)) * (1 + steepest);
    bounds.squeeze =
        std::min(bounds.squeeze, (skew + kelvin_stretch_ * std::max(2 * ahead, -behind)) * inverse);
    return bounds;
  }
  /// Of Kelvin's solution of core s less that of 4 s, at `distance` mm and beyond: PointCore::of_correction.
  At correction(double distance, double s) const {
    const double inverse = 1 / (distance * distance + s), inverse2 = inverse * inverse;
    return {correction_.slope * s * inverse2, correction_.squeeze * s * inverse2,
            correction_.curvature * s * inverse2 * inverse, correction_.shrink * s * inverse2};
  }
  bool is_kelvin() const { return bounds_.empty(); }
  /// What the loops over forces need for the same (near_loops.h).
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
