#pragma once

#include <cstddef>
#include <span>

#include "core/base/simd/simd_target.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {

/// Tables of a source for the inner loop, at even steps that include every node of the protocol's tables (multiples of
/// 0.5 mm for g, of 2.5 mm and 1° for F), so that linear interpolation gives F exactly, and g up to the curvature of
/// the logarithm within 0.1 mm (0.04 % at most). 22 KB: they stay in the L1 cache.
struct DoseTables {
  static constexpr float kRadialStepMm = 0.1f, kAnisotropyStepMm = 2.5f;
  static constexpr std::size_t kRadialCount = 2501;  ///< to 250 mm; farther out the last value
  static constexpr std::size_t kAnisotropyRadii = 31, kAngles = 91;  ///< to 75 mm; 0 … 90° in steps of 1°
  float active_length_mm;
  float scale;                                   ///< total Gy/U where G g F is 1/mm²
  float radial[kRadialCount];                    ///< g
  float anisotropy[kAnisotropyRadii * kAngles];  ///< F, the radii of one angle contiguous
};

/// The tables of a model, computed at the first call. Threads: any.
const DoseTables& dose_tables(SourceModel model);

/// A row of points p_i = p_0 + i s, i = 0, 1, …, relative to a seed, mm: along + i along_step is p_i's coordinate along
/// the seed's axis, away + i away_step the vector (axis × (p_i − centre)) whose length is its distance from the axis.
struct DoseRow {
  float along, along_step;
  float away[3], away_step[3];
};

/// The inner loop of the dose grid, for one instruction set. Threads: any. Real-time: no allocation.
struct DoseLoops {
  /// dose[i] += strength_u × the total dose of 1 U at point i, Gy, i < count: TG-43U1 as in dose_rate.h, in float.
  void (*add_row)(const DoseTables& tables, const DoseRow& row, float strength_u, std::size_t count,
                  float* dose);
};

/// The loops for `target`, which this processor must support.
const DoseLoops& dose_loops(SimdTarget target);

}  // namespace brachy
