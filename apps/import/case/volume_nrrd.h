#pragma once

#include <string>

#include "apps/import/voxels/voxel_volume.h"
#include "core/geometry/label_map/label_map.h"

namespace brachy {

/// The bytes of a .nrrd file that 3D Slicer opens in place: RAS, raw little-endian floats. `content`: "dose", "image";
/// `units`: of a sample, may be empty.
std::string to_nrrd(const VoxelVolume& volume, const std::string& content, const std::string& units);

/// The same of a segmentation (.seg.nrrd): a layer for each of the map's, names, colours and labels of its segments.
std::string to_seg_nrrd(const LabelMap& map);

}  // namespace brachy
