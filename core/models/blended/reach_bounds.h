#pragma once

#include <array>
#include <vector>

#include "core/models/blended/tissue_kernels.h"

namespace brachy {

/// How large one tissue's kernel is from a distance on, for a unit weight f: [0] |C f|, mm, and the nuclear norms of
/// [1] ∇(C f), [2] ∇∂_v(C f), [3] ∇∂_v²(C f) for any unit vector v, 1, 1/mm, 1/mm². Nonincreasing; 10³⁰ at a cusp.
/// Made once; lookups are constant time. Threads: const functions from any.
class ReachBounds {
 public:
  using At = std::array<double, 4>;

  ReachBounds(const ScalarKernels& kernels, std::size_t tissue);
  ReachBounds(const CompactKernels& kernels, std::size_t tissue);  ///< some milliseconds

  /// At `distance` mm and beyond.
  const At& at(double distance) const {
    const double bin = distance * bins_per_mm_;
    return bins_[bin < kBins ? static_cast<std::size_t>(bin) : kBins];
  }
  double support() const { return kBins / bins_per_mm_; }  ///< mm
  double steepest() const { return steepest_; }            ///< mm, where the slope is greatest
  bool has_cusp() const { return bins_[0][3] >= kUnknown; }
  /// Jump of ∇∂_r(C f) at the support's end, 1/mm: that of ψ3,0 alone, which is C¹ there.
  double kink() const { return kink_; }

 private:
  static constexpr std::size_t kBins = 256;
  static constexpr double kUnknown = 1e30;
  void integrate_second(double share);

  double bins_per_mm_, steepest_ = 0, kink_ = 0;
  std::array<At, kBins + 1> bins_{};  // the last: 0
};

}  // namespace brachy
