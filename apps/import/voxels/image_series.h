#pragma once

#include <string>
#include <vector>

#include "apps/import/voxels/voxel_volume.h"

namespace brachy {

class DicomFile;

/// The images of a series (CT, MR, US, …; one slice a file), in any order. Slices may lean, as of a tilted gantry: the
/// grid's third step is from one image's corner to the next one's. Of images that are no one stack, as with a localizer
/// or a report in colour among them, the largest stack is taken; the others, and up to three slices in a row that are
/// missing and interpolated, are told in `left`, one line each. Errors: UserError "FILE: tag: what; fix" where no image
/// is a grey slice, slices lie unevenly, two are in one place, or one of them cannot be read.
VoxelVolume read_image_series(const std::vector<const DicomFile*>& files, std::vector<std::string>& left);

}  // namespace brachy
