#pragma once

#include <string>
#include <string_view>

#include "apps/import/labels/image_voxels.h"
#include "core/geometry/label_map/label_map.h"
#include "core/geometry/label_map/label_nrrd.h"

namespace brachy {

/// Reads a label map from the bytes of a NIfTI-1 or NIfTI-2 file (.nii; .nii.gz: still compressed), either endian: the
/// sform where sform_code > 0, else the qform where qform_code > 0 (NIFTI-1 data format, methods 3 and 2), which are in
/// RAS, in the unit of xyzt_units; a file with neither is refused, as nothing says where it lies. Where both are there
/// and differ by over half a voxel, a note says so. One segment for each value but 0, with the name that a label
/// table in the header's extensions has (TotalSegmentator's). Declared as labels by intent_code 1002 or such a table.
/// Of compressed data no more is decompressed than the header asks for, and none where so few bytes cannot hold it.
/// Errors: UserError "name: field: what; fix", also where there are more than `most_voxels`; NoLabels where the
/// values are no labels. Threads: any.
LabelMap parse_label_nifti(std::string_view bytes, const std::string& name,
                           std::size_t most_voxels = kLabelLimits.max_values);

/// The same as an image, its values scaled by scl_slope and scl_inter; what is not finite is 0.
ImageVoxels parse_image_nifti(std::string_view bytes, const std::string& name, std::size_t most_voxels);

}  // namespace brachy
