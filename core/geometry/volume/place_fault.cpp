#include "core/geometry/volume/place_fault.h"

#include "core/base/number_text.h"

namespace brachy {
namespace {

constexpr double kShortestStepMm = 1e-4, kLongestStepMm = 1e3, kFarthestMm = 1e6;

}  // namespace

std::string place_fault(const VoxelGrid& grid, double independence) {
  for (int k = 0; k < 3; ++k) {
    const double length = grid.steps.col(k).norm();
    if (!(length >= kShortestStepMm && length <= kLongestStepMm))
      return "step " + std::to_string(k + 1) + " is " + text_of(length) +
             " mm long, and voxels are 0.0001 to 1000; correct it, or the unit";
  }
  if (!(std::abs(grid.steps.colwise().normalized().determinant()) >= independence))
    return "the axes lie in a plane; correct them";
  if (!(grid.origin.allFinite() && grid.origin.cwiseAbs().maxCoeff() <= kFarthestMm))
    return "the origin is farther than 1 km away; give it in mm";
  return {};
}

}  // namespace brachy
