#pragma once

#include <string>
#include <string_view>

#include "core/geometry/label_map/label_map.h"

namespace brachy {

/// Reads a label map or a segmentation of 3D Slicer (.nrrd, .seg.nrrd) from the bytes of a file with an attached header
/// (teem's format, https://teem.sourceforge.net/nrrd/format.html): encodings raw, gzip and ascii; three domain axes, or
/// a list of layers and three domain axes; whole numbers of any type, either endian. Space left- or right-,
/// posterior- or anterior-superior (and their reversals) becomes RAS. Segments are those of the keys SegmentN_Name,
/// _LabelValue, _Layer and _Color, or without them one for each value but 0 (named by it). The geometry is that of
/// "space directions" and "space origin", which is the first voxel's also in a map that was cropped:
/// Segmentation_ReferenceImageExtentOffset is already in it.
/// Errors: UserError "name: field: what; fix". Reads no other file. Threads: any.
LabelMap parse_label_nrrd(std::string_view bytes, const std::string& name);

}  // namespace brachy
