#pragma once

#include <string>

#include "core/geometry/label_map/label_map.h"

namespace brachy {

/// What is wrong with a grid's geometry, with the fix; empty: nothing. Voxels are 1 µm to 100 mm apart along axes that
/// are no nearer to one plane than 6°, within 100 m of the origin.
std::string fault_of(const VoxelGrid& grid);

/// One segment for each value but 0 that occurs, layer by layer, by increasing value.
void add_segments_by_value(LabelMap& map);

}  // namespace brachy
