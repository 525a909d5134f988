#pragma once

#include <string>
#include <vector>

#include "apps/import/dicom/dicom_file.h"
#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// A volume of numbers: dose or image.
struct VoxelVolume {
  VoxelGrid grid;             ///< RAS
  std::string frame;          ///< UID of the frame of reference
  std::vector<float> values;  ///< Gy, or the image's rescaled values; x fastest
};

/// Reads an RTDOSE whose grid is in Gy. Errors: UserError "FILE: tag: what; fix".
VoxelVolume read_rt_dose(const DicomFile& file);

/// The images of a series (CT, MR, US, …; one slice a file), in any order. Errors: UserError where they are no stack of
/// parallel slices of one size at equal distances, or one of them cannot be read.
VoxelVolume read_image_series(const std::vector<const DicomFile*>& files);

}  // namespace brachy
