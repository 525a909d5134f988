#pragma once

#include <array>
#include <cstddef>

#include "core/kernels/kernels.h"

namespace brachy {

/// How large a kernel's derivatives are from a distance on: nonincreasing bounds over [r, ∞), r in support radii.
/// Built once for a kernel; lookups are constant time. Threads: any.
class KernelBounds {
 public:
  explicit KernelBounds(const Kernel& kernel);

  /// max |ψ′| from r on.
  double slope(double r) const { return slope_[bin(r)]; }
  /// max over unit vectors of |D³ψ(|x|)[v, v, v]| from r on; infinite at the cusp of ψ3,0. As a symmetric form's norm
  /// it bounds D³ψ[e, e, v] too (Banach).
  double third(double r) const { return third_[bin(r)]; }
  /// Jump of ψ″ at r = 1, where the support ends: 0 but for ψ3,0.
  double kink() const { return kink_; }
  bool has_cusp() const { return third_[0] > 1e300; }  ///< ∇ψ has no limit at 0

 private:
  static constexpr std::size_t kBins = 256;
  static std::size_t bin(double r) { return r < 1 ? static_cast<std::size_t>(r * kBins) : kBins; }

  std::array<double, kBins + 1> slope_{}, third_{};  // over [k/kBins, ∞)
  double kink_ = 0;
};

}  // namespace brachy
