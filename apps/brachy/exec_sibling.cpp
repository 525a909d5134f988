#include "apps/brachy/exec_sibling.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/error.h"

namespace brachy {

bool is_import_command(int argc, char** argv) {
  if (argc < 2) return false;
  const std::string_view command = argv[1];
  return command == "import" ||
         (command == "export" && std::any_of(argv + 2, argv + argc, [](std::string_view word) {
            return word == "--dicom" || word.starts_with("--dicom=");
          }));
}

void exec_sibling(const std::string& program, char** argv, const std::string& fix) {
  std::error_code ignored;
  const std::filesystem::path sibling =
      std::filesystem::read_symlink("/proc/self/exe", ignored).replace_filename(program);
  execv(sibling.c_str(), argv);
  throw UserError(std::string(argv[1]) + " needs " + sibling.string() + ", which cannot be run (" +
                  std::strerror(errno) + "); " + fix);
}

}  // namespace brachy
