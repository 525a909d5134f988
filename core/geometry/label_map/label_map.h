#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// A segmentation: which voxels belong to which structure.
struct LabelMap {
  /// A structure: the voxels of one layer that have one value.
  struct Segment {
    std::string name;  ///< as the file has it; may be empty
    std::uint16_t value = 0;
    std::size_t layer = 0;
    std::optional<std::array<double, 3>> colour;  ///< red, green, blue, 0 … 1
  };

  VoxelGrid grid;
  std::vector<std::vector<std::uint16_t>> layers;  ///< each of grid.count() values; 0 belongs to none
  std::vector<Segment> segments;
  std::vector<std::string> notes;  ///< what in the file was not taken, one line each
  bool is_declared = false;        ///< the file itself says that its values are labels
};

/// One segment for each value but 0 that occurs, layer by layer, by increasing value.
void add_segments_by_value(LabelMap& map);

/// Axes of a map are no nearer to one plane than 6°: place_fault's `independence`.
inline constexpr double kLabelIndependence = 0.1;

}  // namespace brachy
