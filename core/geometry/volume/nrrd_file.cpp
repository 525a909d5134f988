#include "core/geometry/volume/nrrd_file.h"

#include "core/geometry/volume/file_bytes.h"
#include "core/geometry/volume/nrrd_data.h"

namespace brachy {

NrrdVolume parse_nrrd(std::string_view bytes, const std::string& name, const NrrdLimits& limits) {
  const NrrdHeader header = parse_nrrd_header(bytes, name, limits);
  return {Volume(header.grid, parse_nrrd_data(header, bytes, name)), header.type};
}

NrrdVolume read_nrrd_file(const std::filesystem::path& file, const NrrdLimits& limits) {
  return parse_nrrd(file_bytes(file, limits.max_bytes), file.string(), limits);
}

}  // namespace brachy
