#pragma once

#include <cstddef>

#include "core/base/simd/simd_target.h"

namespace brachy {

/// Two pieces of shaft that are far from each other, a and b, as two points each (NearMatrix); so many pairs at once.
struct alignas(64) FarPairs {
  static constexpr std::size_t kCount = 8;
  using Lanes = double[kCount];
  /// What a landmark of a, side i, has of point k there, with one of b, side j, of point q; at [2i + j][2k + q].
  using Weights = Lanes[4][4];

  Lanes x[4], y[4], z[4];  ///< from b's point q to a's point k, at 2k + q, mm
  Lanes s;                 ///< mm² (kelvin.h)
  Weights weight;          ///< across both shafts
  /// How much more it is along a's shaft, along b's, and of what is along both: products of differences.
  Weights along_a, along_b, along_both;
  Lanes axis_a[3], axis_b[3];  ///< of the shafts, unit
  bool are_even;               ///< those three are all 0
};

/// Σ A G B over the points, by sides, with Kelvin's solution G and shares A = α I + α′ a aᵀ and B: what the pieces add
/// to K between their landmarks, row by row; mm/N.
struct alignas(64) FarBlocks {
  FarPairs::Lanes value[4][9];
};

/// `b` and s as in kelvin.h; `scale`: of a force. The same bits for every target, and G as kelvin() has it.
using FarPairLoop = void (*)(const FarPairs& pairs, double b, double scale, FarBlocks& blocks);

/// The loop for `target`, which must be supported by this processor. Threads: any. Real-time: no allocation.
FarPairLoop far_pair_loop(SimdTarget target);

}  // namespace brachy
