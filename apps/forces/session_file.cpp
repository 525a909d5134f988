#include "apps/forces/session_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/base/error.h"

namespace brachy {

int open_session_file(const std::filesystem::path& file) {
  // A FIFO without a reader would block.
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK, 0600);
  if (descriptor < 0)
    throw UserError(file.string() + ": cannot be written: " + std::strerror(errno) +
                    "; give another directory");
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(descriptor);
    throw UserError(file.string() + ": is not a regular file; remove it, or give another directory");
  }
  // Of an earlier version's file, or of another user's, it may fail.
  [[maybe_unused]] const int is_private = ::fchmod(descriptor, 0600);
  return descriptor;
}

}  // namespace brachy
