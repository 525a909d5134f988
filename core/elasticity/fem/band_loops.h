#pragma once

#include <cstddef>

#include "core/solve/panel_loops.h"

namespace brachy {

/// Many right-hand sides at once: row r of all of them is 24 consecutive doubles, 64-byte aligned.
struct BandRow {
  static constexpr int kCount = 24;
  alignas(64) double column[kCount];
};

/// Sets of right-hand sides that are solved together, so that a panel of the matrix is read from memory once for all
/// of them: set q begins at x + q · stride. Each has n rows, rounded up to whole panels.
struct BandSets {
  BandRow* x;
  std::size_t count, stride;
};

/// Triangular solves with a factored BandMatrix of n rows.
/// Threads: any. Real-time: no allocation.
struct BandLoops {
  /// x = L⁻¹ x, given that x is zero before row `first`.
  void (*forward)(const BandMatrix& matrix, int n, int first, const BandSets& sets);
  /// x = L⁻ᵀ x, rows from `first` on; those before are left undefined.
  void (*backward)(const BandMatrix& matrix, int n, int first, const BandSets& sets);
};

/// The loops for `target`, which this processor must support.
const BandLoops& band_loops(SimdTarget target);

}  // namespace brachy
