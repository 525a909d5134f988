#include "core/geometry/volume/file_bytes.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "core/base/denied_folder.h"
#include "core/base/error.h"

namespace brachy {

std::string file_bytes(const std::filesystem::path& file, std::size_t max_bytes) {
  const std::string name = file.string();
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  refuse_denied_folder(file);
  if (!std::filesystem::exists(status)) throw UserError(name + ": no such file; check the path");
  // A pipe or device could block or never end.
  if (!std::filesystem::is_regular_file(status)) throw UserError(name + ": is not a file; name one");
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) throw UserError(name + ": cannot be read: " + error.message());
  if (size > max_bytes)
    throw UserError(name + ": has more than " + std::to_string(max_bytes >> 20) +
                    " MiB; crop or resample it, or save it compressed");
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) throw UserError(name + ": cannot be opened: " + std::strerror(errno));
  std::string bytes(static_cast<std::size_t>(size), '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(in.gcount()) != size)
    throw UserError(name + ": cannot be read to its end; check the disk, or that nothing is writing it");
  return bytes;
}

}  // namespace brachy
