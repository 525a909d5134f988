#pragma once

#include <cstdlib>
#include <filesystem>

namespace brachy::test {

/// The shared data folder named by BRACHY_DATA_DIR (set by .ci/run), or empty: such a test is skipped.
inline std::filesystem::path data_dir() {
  const char* dir = std::getenv("BRACHY_DATA_DIR");
  return dir && std::filesystem::is_directory(dir) ? std::filesystem::path(dir) : std::filesystem::path();
}

}  // namespace brachy::test

#define BRACHY_REQUIRE_DATA(name)             \
  const auto name = brachy::test::data_dir(); \
  if (name.empty()) GTEST_SKIP() << "BRACHY_DATA_DIR is not set: the shared data is absent"
