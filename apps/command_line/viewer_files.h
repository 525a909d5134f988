#pragma once

#include <filesystem>

#include "net/http/served_files.h"

namespace brachy {

/// The viewer, from beside the program that runs: ../viewer in a build folder, ../share/brachy/viewer where it is
/// installed; else a page that says how to build it.
inline net::ServedFiles viewer_files() {
  std::error_code error;
  const auto bin = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* folder : {"../viewer", "../share/brachy/viewer"})
    if (std::filesystem::is_regular_file(bin / folder / "index.html", error))
      return net::ServedFiles(bin / folder);
  return {};
}

}  // namespace brachy
