#include "apps/command_line/exec_sibling.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/base/error.h"

namespace brachy {

void exec_sibling(const std::string& program, const std::string& what, char** argv, const std::string& fix) {
  std::error_code ignored;
  const std::filesystem::path sibling =
      std::filesystem::read_symlink("/proc/self/exe", ignored).replace_filename(program);
  execv(sibling.c_str(), argv);
  throw UserError(what + " needs " + sibling.string() + ", which cannot be run (" + std::strerror(errno) +
                  "); " + fix);
}

}  // namespace brachy
