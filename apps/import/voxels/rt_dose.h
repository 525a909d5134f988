#pragma once

#include "apps/import/dicom/dicom_file.h"
#include "apps/import/voxels/voxel_volume.h"

namespace brachy {

/// Reads an RTDOSE whose grid is in Gy. Errors: UserError "FILE: tag: what; fix".
VoxelVolume read_rt_dose(const DicomFile& file);

}  // namespace brachy
