#include "apps/brachy/exec_study.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "core/base/error.h"

namespace brachy {

void exec_study(char** argv) {
  std::error_code ignored;
  const std::filesystem::path study =
      std::filesystem::read_symlink("/proc/self/exe", ignored).replace_filename("brachy-study");
  execv(study.c_str(), argv);
  throw UserError(std::string(argv[1]) + " needs " + study.string() + ", which cannot be run (" +
                  std::strerror(errno) +
                  "); build it with scripts/build.sh release brachy-study, or install the package brachyd");
}

}  // namespace brachy
