#pragma once

#include <vector>

#include "apps/import/voxels/voxel_volume.h"

namespace brachy {

class DicomFile;

/// The images of a series (CT, MR, US, …; one slice a file), in any order. Slices may lean, as of a tilted gantry: the
/// grid's third step is from one image's corner to the next one's. Errors: UserError "FILE: tag: what; fix" where they
/// are no stack of parallel grey slices of one size, spacing and frame of reference at equal distances along a line, or
/// one of them cannot be read.
VoxelVolume read_image_series(const std::vector<const DicomFile*>& files);

}  // namespace brachy
