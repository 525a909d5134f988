#include "core/geometry/volume/nrrd_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "core/geometry/volume/nrrd_data.h"

namespace brachy {
namespace {

std::string bytes_of_nrrd(const std::filesystem::path& file, std::size_t max_bytes) {
  const std::string name = file.string();
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  refuse_denied_folder(file);
  if (!std::filesystem::exists(status)) throw UserError(name + ": no such file; check the path");
  // A pipe or device could block or never end.
  if (!std::filesystem::is_regular_file(status)) throw UserError(name + ": is not a file; name an .nrrd");
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) throw UserError(name + ": cannot be read: " + error.message());
  if (size > max_bytes)
    throw UserError(name + ": has more than " + std::to_string(max_bytes >> 20) +
                    " MiB; crop or resample the volume, or save it with encoding gzip");
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) throw UserError(name + ": cannot be opened: " + std::strerror(errno));
  std::string bytes(static_cast<std::size_t>(size), '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(in.gcount()) != size)
    throw UserError(name + ": cannot be read to its end; check the disk, or that nothing is writing it");
  return bytes;
}

}  // namespace

NrrdVolume parse_nrrd(std::string_view bytes, const std::string& name, const NrrdLimits& limits) {
  const NrrdHeader header = parse_nrrd_header(bytes, name, limits);
  return {Volume(header.grid, parse_nrrd_data(header, bytes, name)), header.type};
}

NrrdVolume read_nrrd_file(const std::filesystem::path& file, const NrrdLimits& limits) {
  return parse_nrrd(bytes_of_nrrd(file, limits.max_bytes), file.string(), limits);
}

}  // namespace brachy
