#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/dose/dose_grid.h"
#include "core/surface/surface_bvh.h"

namespace brachy {

/// Which of a grid's voxels (cubes of one spacing about its points) a structure fills, and how far.
struct StructureVoxels {
  std::vector<std::uint32_t> voxel;  ///< index in DoseGrid::dose_gy(), each once, increasing
  std::vector<float> share;          ///< of that voxel's volume inside the structure, 0 < share ≤ 1
  double volume_cc = 0;              ///< of all of these; what lies outside the grid is not in it
};

/// By rays along z, no more than kRaySpacingMm apart and at least two by two a voxel: their lengths inside are exact.
StructureVoxels structure_voxels(const SurfaceBvh& surface, const DoseGrid& grid);
inline constexpr double kRaySpacingMm = 0.25;

/// A structure's dose-volume histogram and what is read off it, as ABS and ESTRO guidelines define them: V100 is the
/// volume that gets at least 100 % of the prescription, D90 the dose that 90 % of the volume gets at least, D2cc the
/// same of 2 cm³. All of the part of the structure that lies in the grid.
struct StructureDose {
  std::string name;
  double volume_cc = 0;
  double mean_gy = 0, min_gy = 0, max_gy = 0;                   ///< of the voxels
  double v100_percent = 0, v150_percent = 0, v200_percent = 0;  ///< of volume_cc
  double v100_cc = 0;
  double d90_gy = 0, d30_gy = 0, d10_gy = 0;
  double d2cc_gy = 0;  ///< NaN where volume_cc < 2
  std::vector<float>
      volume_share;  ///< cumulative DVH: of the volume, with at least k % of the prescription, k = 0 … 300
};

/// Reads them off a histogram of 0.1 % of the prescription a bin, linear within a bin; above kHistogramEnd × the
/// prescription one bin up to the largest dose. A structure without a voxel has zeros, and NaN for doses.
StructureDose structure_dose(std::string name, const StructureVoxels& voxels, const DoseGrid& grid,
                             double prescription_gy);
inline constexpr double kHistogramEnd = 10;

}  // namespace brachy
