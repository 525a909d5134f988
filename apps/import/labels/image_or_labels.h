#pragma once

#include <string>

#include "core/geometry/label_map/label_map.h"

namespace brachy {

/// Why a file whose values are all whole and 0 … 65535 is an image nonetheless; empty: it is a label map. The rule, in
/// this order:
/// - what the file declares (named segments, NIfTI's intent or label table) decides;
/// - one value beside 0 is a mask;
/// - a word of the file's name: "ct", "mr", "us", "image" … of an image, "seg", "label", "mask" … of a label map;
/// - labels lie in pieces on a background of 0: of the pairs of neighbours that are not both 0, a label map has most
///   within one piece, an image few. Of up to 8 values 30 % of the pairs have to be equal, of up to 128 55 %, beyond
///   and where less than a twentieth of the voxels is 0, 80 %.
std::string image_reason(const LabelMap& map, const std::string& file);

}  // namespace brachy
