#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/volume/nrrd_header.h"

namespace brachy {

/// The values of an NRRD whose header is `header`, from all of the file's bytes. As parse_nrrd.
std::vector<float> parse_nrrd_data(const NrrdHeader& header, std::string_view bytes, const std::string& name);

}  // namespace brachy
