#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/dose_grid.h"
#include "core/brachytherapy/dose/structure_voxels.h"

namespace brachy {

/// A structure's dose-volume histogram and the figures derived from it, as ABS and ESTRO guidelines define them: V100
/// is the volume that receives at least 100 % of the prescription, D90 the minimum dose to the hottest 90 % of the
/// volume, D2cc that to the hottest 2 cm³. All refer to the part of the structure that lies in the grid.
struct StructureDose {
  std::string name;
  double volume_cc = 0;
  double mean_gy = 0, min_gy = 0, max_gy = 0;                   ///< of the voxels
  double v100_percent = 0, v150_percent = 0, v200_percent = 0;  ///< of volume_cc
  double v100_cc = 0;
  double d90_gy = 0, d30_gy = 0, d10_gy = 0;
  double d2cc_gy = 0;               ///< NaN where volume_cc < 2
  double d5_gy = 0, d0_1cc_gy = 0;  ///< the latter NaN where volume_cc < 0.1; neither is in DOSE
  /// cumulative DVH: of the volume, with at least k % of the prescription, k = 0 … 300
  std::vector<float> volume_share;
};

/// A piece of a structure that has one dose.
struct DoseSample {
  double gy, volume_mm3;
};

/// The figures of a structure of `volume_cc` whose dose is that of the samples. Their histogram has bins of 0.1 % of
/// the prescription and is linear within a bin; above kHistogramEnd × the prescription one bin extends to the largest
/// dose. Without a sample there are zeros, and NaN for doses.
StructureDose structure_dose(std::string name, double volume_cc, std::span<const DoseSample> samples,
                             double prescription_gy);
inline constexpr double kHistogramEnd = 10;

/// Each whole voxel has the dose at its centre, each partial voxel the interpolated dose at the centre of its part.
StructureDose structure_dose(std::string name, const StructureVoxels& voxels, const DoseGrid& grid,
                             double prescription_gy);

}  // namespace brachy
