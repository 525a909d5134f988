#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/dose_grid.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

inline constexpr std::array<int, 4> kIsodosePercent = {50, 100, 150, 200};  ///< of the prescription
inline constexpr double kSliceSpacingMm = 5;

/// Pieces of outlines in a plane: from (x0, y0) to (x1, y1), mm.
using OutlinePieces = std::vector<std::array<double, 4>>;

/// An axial slice, in the plane z.
struct AxialSlice {
  struct Outline {
    std::string name;  ///< of the structure
    OutlinePieces pieces;
  };
  double z_mm = 0;
  std::vector<Outline> structures;                             ///< those that the plane cuts
  std::array<OutlinePieces, kIsodosePercent.size()> isodoses;  ///< by kIsodosePercent
};

/// Slices at multiples of kSliceSpacingMm through the first structure, the prostate. Isodoses by marching squares
/// between the grid's points in x and y (DoseGrid::at), linear along the squares' edges. Deterministic.
std::vector<AxialSlice> axial_slices(const std::vector<Structure>& structures, const DoseGrid& dose,
                                     double prescription_gy);

}  // namespace brachy
