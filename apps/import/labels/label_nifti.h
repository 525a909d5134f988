#pragma once

#include <string>
#include <string_view>

#include "core/geometry/label_map/label_map.h"

namespace brachy {

/// Reads a label map from the bytes of a NIfTI-1 or NIfTI-2 file (.nii; .nii.gz: still compressed), either endian: the
/// sform where sform_code > 0, else the qform where qform_code > 0 (NIFTI-1 data format, methods 3 and 2), which are in
/// RAS; a file with neither is refused, as nothing says where it lies. One segment for each value but 0.
/// Errors: UserError "name: field: what; fix". Threads: any.
LabelMap parse_label_nifti(std::string_view bytes, const std::string& name);

}  // namespace brachy
