#pragma once

#include <string>
#include <string_view>

#include "core/geometry/label_map/label_map.h"
#include "core/geometry/volume/nrrd_header.h"

namespace brachy {

/// 2²⁹ voxels of all layers, 64 layers, files of 2 GiB.
inline constexpr NrrdLimits kLabelLimits{std::size_t{1} << 29, std::size_t{2} << 30, 64};

/// Reads a label map or a segmentation of 3D Slicer (.nrrd, .seg.nrrd) from the bytes of a file: parse_nrrd_header's,
/// whose values are whole, 0 … 65535, of any type. Segments are those of the keys SegmentN_Name, _LabelValue, _Layer
/// and _Color, or without them one for each value but 0. The geometry is that of "space directions" and "space origin",
/// which is the first voxel's also in a map that was cropped: Segmentation_ReferenceImageExtentOffset is already in it.
/// Errors: UserError "name: what; fix", one line. Memory: 2 bytes a value, twice that with layers. Reads no other file.
/// Threads: any.
LabelMap parse_label_nrrd(std::string_view bytes, const std::string& name,
                          const NrrdLimits& limits = kLabelLimits);

/// The same for a header that is read already, of whatever file it is. Errors: NoLabels where the values are no labels.
LabelMap read_label_volume(const NrrdHeader& header, std::string_view bytes, const std::string& name);

}  // namespace brachy
