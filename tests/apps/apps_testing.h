#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "test_paths.h"
#include "tests/apps/child_process.h"

namespace brachy::test {

inline const std::filesystem::path kConfigFolder = BRACHY_CONFIG_DIR;

/// A temporary directory of one test, removed with its content.
class TempFolder {
 public:
  TempFolder();
  ~TempFolder();
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  /// Writes a file and returns its path.
  std::string write(const std::string& name, const std::string& text) const;

 private:
  std::filesystem::path path_;
};

std::string read_file(const std::filesystem::path& file);

/// `brachy ARGUMENTS…` and `brachyd ARGUMENTS…`, to their end.
Ended run_brachy(std::vector<std::string> arguments);
Ended run_brachyd(std::vector<std::string> arguments);

/// The command lines, for a ChildProcess.
std::vector<std::string> brachy_line(std::vector<std::string> arguments);
std::vector<std::string> brachyd_line(std::vector<std::string> arguments);

/// Whether the process exited normally with `code`.
::testing::AssertionResult exited(const Ended& ended, int code);

/// Exit code 2, nothing on stdout, and one line on stderr that contains each of `parts`.
::testing::AssertionResult refused_in_one_line(const Ended& ended, const std::vector<std::string>& parts);

/// The last line of stdout as JSON; discarded() where it is not JSON.
nlohmann::json json_of(const Ended& ended);

/// A scene of 3,000 points, cheap to load, on a free port, with the cheapest model unless `more`, which is appended,
/// has a [model].
std::string small_scene(const std::string& more = "");

/// A needle straight into the phantom along +z, a sideways push, and out again, in `duration_s`: header and rows.
std::string short_insertion(double duration_s);

/// Closed ASCII STL of an octahedron with corners at ±size on the axes, mm.
std::string octahedron_stl(double size);

}  // namespace brachy::test
