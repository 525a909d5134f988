#pragma once

#include "core/solve/panel_loops.h"

namespace brachy {

/// Many right-hand sides at once: row r of all of them is 24 consecutive doubles, 64-byte aligned.
struct BandRow {
  static constexpr int kCount = 24;
  alignas(64) double column[kCount];
};

/// Triangular solves with a factored BandMatrix of n rows. x has n rows, rounded up to whole panels.
/// Threads: any. Real-time: no allocation.
struct BandLoops {
  /// x = L⁻¹ x, given that x is zero before row `first`.
  void (*forward)(const BandMatrix& matrix, int n, int first, BandRow* x);
  /// x = L⁻ᵀ x, rows from `first` on; those before are left undefined.
  void (*backward)(const BandMatrix& matrix, int n, int first, BandRow* x);
};

/// The loops for `target`, which this processor must support.
const BandLoops& band_loops(SimdTarget target);

}  // namespace brachy
