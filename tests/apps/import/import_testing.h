#pragma once

#include <string>
#include <vector>

#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "test_paths.h"
#include "tests/apps/apps_testing.h"

// What the tests of `brachy import` share.
namespace brachy::test {

inline std::string source_file(const char* name) {
  return std::string(BRACHY_SOURCE_DIR) + "/tests/apps/import/" + name;
}

/// Runs Debian's Python, which has pydicom.
inline Ended run_python(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "/usr/bin/python3");
  return run_process(arguments);
}

inline bool has_pydicom() {
  static const bool has = bool{exited(run_python({"-c", "import pydicom, numpy"}), 0)};
  return has;
}

/// Exit code 2, nothing on stdout, and a last line on stderr, behind those of a slow run's progress, with all `parts`.
inline ::testing::AssertionResult refused_in_last_line(const Ended& ended,
                                                       const std::vector<std::string>& parts) {
  const std::vector<std::string> lines = lines_of(ended.err);
  if (ended.exit_code != 2 || !ended.out.empty() || lines.empty())
    return ::testing::AssertionFailure() << "exit code " << ended.exit_code << ": " << ended.out << ended.err;
  for (std::size_t n = 0; n + 1 < lines.size(); ++n)
    if (!lines[n].starts_with("import: "))
      return ::testing::AssertionFailure() << "more than progress: " << lines[n];
  for (const std::string& part : parts)
    if (lines.back().find(part) == std::string::npos)
      return ::testing::AssertionFailure() << "no \"" << part << "\" in: " << lines.back();
  return ::testing::AssertionSuccess();
}

inline nlohmann::json json_file(const std::filesystem::path& file) {
  return nlohmann::json::parse(read_file(file), nullptr, false);
}

inline SurfaceMesh surface_file(const std::filesystem::path& file) {
  return prepare_surface(read_mesh_file(file), {}, file.string()).mesh;
}

}  // namespace brachy::test
