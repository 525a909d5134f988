#pragma once

#include <cstddef>

#include "core/base/simd/simd_target.h"

namespace brachy {

/// Two pieces of shaft that are far from each other, a and b, as two points each (NearMatrix); so many pairs at once.
struct alignas(64) FarPairs {
  static constexpr std::size_t kCount = 8;
  using Lanes = double[kCount];

  Lanes x[4], y[4], z[4];  ///< from b's point q to a's point k, at 2k + q, mm
  Lanes s;                 ///< mm² (kelvin.h)
  bool are_even;           ///< all of them: shares are numbers, else matrices, row by row
  /// What a landmark of a, side i, has of point k there, with one of b, side j, of point q: at [2i + j][2k + q] the
  /// product of both shares and the tissue's weight …
  Lanes even[4][4];
  /// … or these apart: at [2i + j], [k][i] and [q][j].
  Lanes weight[4], share_a[2][2][9], share_b[2][2][9];
};

/// Σ A G B over the points, by sides, with Kelvin's solution G and shares A and B: what the pieces add to K between
/// their landmarks, row by row; mm/N.
struct alignas(64) FarBlocks {
  FarPairs::Lanes value[4][9];
};

/// `b` and s as in kelvin.h; `scale`: of a force. The same bits for every target.
using FarPairLoop = void (*)(const FarPairs& pairs, double b, double scale, FarBlocks& blocks);

/// The loop for `target`, which must be supported by this processor. Threads: any. Real-time: no allocation.
FarPairLoop far_pair_loop(SimdTarget target);

}  // namespace brachy
