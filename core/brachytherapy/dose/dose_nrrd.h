#pragma once

#include <string>

#include "core/brachytherapy/dose/dose_grid.h"

namespace brachy {

/// The grid as the bytes of a .nrrd file, which 3D Slicer and ITK place in the world: attached header (teem's format
/// NRRD0004, https://teem.sourceforge.net/nrrd/format.html), right-anterior-superior space with directions and origin
/// in mm, raw little-endian floats in Gy, x fastest.
std::string to_nrrd(const DoseGrid& grid);

}  // namespace brachy
