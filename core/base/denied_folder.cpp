#include "core/base/denied_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "core/base/error.h"
#include "core/base/one_line.h"

namespace brachy {

std::optional<std::filesystem::path> denied_folder(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0 || errno != EACCES) return std::nullopt;
  std::filesystem::path folder = file.is_absolute() ? file : std::filesystem::path(".") / file;
  // The innermost folder that can be seen is the one that cannot be entered.
  while (folder.has_parent_path() && folder != folder.parent_path()) {
    folder = folder.parent_path();
    if (::stat(folder.c_str(), &status) == 0) return folder;
  }
  return folder;
}

void refuse_denied_folder(const std::filesystem::path& file) {
  const auto folder = denied_folder(file);
  if (!folder) return;
  throw UserError(one_line(file.string() + ": no permission to enter the folder " + folder->string() +
                           "; give its user or group the right (chmod +x), or start brachyd as its owner"));
}

}  // namespace brachy
