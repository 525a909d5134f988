#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/volume/nrrd_header.h"

namespace brachy {

/// The values of an NRRD whose header is `header`, from all of the file's bytes: header.count() of them in the file's
/// order. As parse_nrrd.
std::vector<float> parse_nrrd_data(const NrrdHeader& header, std::string_view bytes, const std::string& name);

/// As labels. Errors as parse_nrrd_data, and as label_of.
std::vector<std::uint16_t> parse_nrrd_labels(const NrrdHeader& header, std::string_view bytes,
                                             const std::string& name);

/// The file is an image: a value, or its scale, cannot be a label's.
class NoLabels : public UserError {
 public:
  using UserError::UserError;
};

/// A voxel's value as a label. Errors: NoLabels "name: …" where it is negative, above 65535 or not whole.
std::uint16_t label_of(double value, const std::string& name);

/// label_of for each whole voxel in `bytes`.
void append_labels(std::vector<std::uint16_t>& labels, std::string_view bytes, const VoxelType& type,
                   const std::string& name);

}  // namespace brachy
