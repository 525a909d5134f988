#include "apps/import/labels/label_values.h"

#include <vector>

namespace brachy {

std::string fault_of(const VoxelGrid& grid) {
  if (!grid.steps.allFinite() || !grid.origin.allFinite())
    return "has a number that is not finite; write the file again";
  const Vec3 lengths = grid.steps.colwise().norm();
  if (!(lengths.minCoeff() >= 1e-3 && lengths.maxCoeff() <= 100))
    return "voxels must be 0.001 … 100 mm apart; give the spacing in mm";
  if (!(std::abs(grid.steps.determinant()) >= 0.1 * lengths.prod()))
    return "the three axes must not lie in a plane; write the file again";
  if (!(grid.origin.cwiseAbs().maxCoeff() <= 1e5))
    return "lies farther than 100 m from the origin; give it in mm";
  return {};
}

void add_segments_by_value(LabelMap& map) {
  for (std::size_t layer = 0; layer < map.layers.size(); ++layer) {
    std::vector<bool> occurs(65536, false);
    for (const std::uint16_t value : map.layers[layer]) occurs[value] = true;
    for (std::size_t value = 1; value < occurs.size(); ++value)
      if (occurs[value]) map.segments.push_back({"", static_cast<std::uint16_t>(value), layer, {}});
  }
}

}  // namespace brachy
