#pragma once

#include <string>
#include <string_view>

#include "core/geometry/volume/nrrd_header.h"

namespace brachy {

/// Whether these are the bytes of a MetaImage (.mha, .mhd).
bool is_meta_image(std::string_view bytes);

/// Reads the header of a MetaImage with its data in the same file (.mha), as one of an NRRD with the same data: three
/// axes, MET_… of whole numbers to 64 bits, float or double; raw or compressed by zlib; Offset (or Position, Origin),
/// TransformMatrix (or Rotation, Orientation: for each axis its direction) and ElementSpacing (or ElementSize) in LPS
/// and mm (https://itk.org/Wiki/ITK/MetaIO/Documentation). Errors: UserError "name: what; fix". Threads: any.
NrrdHeader parse_meta_header(std::string_view bytes, const std::string& name, const NrrdLimits& limits);

}  // namespace brachy
