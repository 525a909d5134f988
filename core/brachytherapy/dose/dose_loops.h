#pragma once

#include <cstddef>
#include <vector>

#include "core/base/simd/simd_target.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {

/// A grid of F's values at even steps, within which interpolation is linear: exactly F where it includes every node of
/// the source's table.
struct AnisotropyGrid {
  float step_mm;
  std::size_t radii,
      angles;  ///< from 0 in steps of step_mm; of 1°, to 90° of the folded one and to 180° of the other

  bool operator==(const AnisotropyGrid&) const = default;
};

/// Tables of a source for the inner loop, at even steps that include every node of the protocol's tables (multiples of
/// 0.1 mm for g and 1° for F, and of 2.5 mm or 0.5 mm for F), so that linear interpolation gives F exactly, and g up
/// to the curvature of the logarithm within 0.1 mm (0.04 % at most). Between other nodes it is as close as the steps
/// are.
struct DoseTables {
  static constexpr float kRadialStepMm = 0.1f;
  static constexpr std::size_t kRadialCount = 2501;  ///< to 250 mm; farther out the last value
  /// Of a symmetric source whose nodes it includes: to 75 mm; 22 KB in all, which stay in the L1 cache.
  static constexpr AnisotropyGrid kFolded{2.5f, 31, 91};
  /// Of any other: to 100 mm; 146 KB.
  static constexpr AnisotropyGrid kFull{0.5f, 201, 181};
  bool is_folded;  ///< kFolded, else kFull
  float active_length_mm;
  float half_length_mm, radius_mm;  ///< of the capsule
  float scale;                      ///< total Gy/U where G g F is 1/mm²
  float radial[kRadialCount];       ///< g
  std::vector<float> anisotropy;    ///< F, the radii of one angle contiguous
};

DoseTables make_dose_tables(const Tg43Source& source);

/// The tables of a model, computed at the first call. Threads: any.
const DoseTables& dose_tables(SourceModel model);

/// A row of points p_i = p_0 + i s, i = 0, 1, …, relative to a seed, mm: along + i along_step is p_i's coordinate along
/// the seed's axis, away + i away_step the vector (axis × (p_i − centre)) whose length is its distance from the axis.
struct DoseRow {
  float along, along_step;
  float away[3], away_step[3];
};

/// Points that lie anywhere, and a seed, mm. After the points x, y and z have kLanes more floats, of any value.
struct DoseScatter {
  static constexpr std::size_t kLanes = 16;  ///< of the widest vector
  const float *x, *y, *z;
  float seed[3], axis[3];  ///< its centre, and its direction, of unit length
};

/// The inner loops of dose sums, for one instruction set. Threads: any. Real-time: no allocation.
struct DoseLoops {
  /// dose[i] += strength_u × the total dose of 1 U at point i, Gy, i < count: TG-43U1 as in dose_rate.h, in float.
  void (*add_row)(const DoseTables& tables, const DoseRow& row, float strength_u, std::size_t count,
                  float* dose);
  void (*add_points)(const DoseTables& tables, const DoseScatter& points, float strength_u, std::size_t count,
                     float* dose);  ///< the same
};

/// The loops for `target`, which this processor must support.
const DoseLoops& dose_loops(SimdTarget target);

}  // namespace brachy
