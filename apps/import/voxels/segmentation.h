#pragma once

#include "apps/import/dicom/dicom_file.h"
#include "core/geometry/label_map/label_map.h"

namespace brachy {

/// A DICOM segmentation (PS3.3, A.51 and C.8.20) as a label map: BINARY, FRACTIONAL from half of its largest value on,
/// or LABELMAP of 8 bits. Frames come in any order, and those without a voxel may be missing. Segments that overlap are
/// in layers of their own. Errors: UserError "FILE: tag: what; fix" where frames are no parallel planes at equal
/// distances, or a tag is missing.
LabelMap read_segmentation(const DicomFile& file);

}  // namespace brachy
