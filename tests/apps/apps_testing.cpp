#include "tests/apps/apps_testing.h"

#include <stdlib.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "haptics/trajectory/trajectory.h"
#include "test_paths.h"

namespace brachy::test {

TempFolder::TempFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "brachy_test_XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("mkdtemp failed");
  path_ = name;
}

TempFolder::~TempFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string TempFolder::write(const std::string& name, const std::string& text) const {
  std::ofstream out(path_ / name, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(name + ": cannot be written");
  return (path_ / name).string();
}

std::string read_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  return text.str();
}

std::vector<std::string> brachy_line(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), BRACHY_BINARY);
  return arguments;
}
std::vector<std::string> brachyd_line(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), BRACHYD_BINARY);
  return arguments;
}
Ended run_brachy(std::vector<std::string> arguments) {
  return run_process(brachy_line(std::move(arguments)));
}
Ended run_brachyd(std::vector<std::string> arguments) {
  return run_process(brachyd_line(std::move(arguments)));
}

::testing::AssertionResult exited(const Ended& ended, int code) {
  if (ended.exit_code == code) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << "exit code " << ended.exit_code << " instead of " << code << ", signal " << ended.signal
         << (ended.timed_out ? ", timed out" : "") << "\nstdout: " << ended.out << "\nstderr: " << ended.err;
}

::testing::AssertionResult refused_in_one_line(const Ended& ended, const std::vector<std::string>& parts) {
  if (const auto code = exited(ended, 2); !code) return code;
  if (!ended.out.empty()) return ::testing::AssertionFailure() << "wrote to stdout: " << ended.out;
  if (lines_of(ended.err).size() != 1)
    return ::testing::AssertionFailure() << "not one line on stderr: " << ended.err;
  for (const std::string& part : parts)
    if (ended.err.find(part) == std::string::npos)
      return ::testing::AssertionFailure() << "stderr lacks '" << part << "': " << ended.err;
  return ::testing::AssertionSuccess();
}

nlohmann::json json_of(const Ended& ended) {
  const auto lines = lines_of(ended.out);
  return nlohmann::json::parse(lines.empty() ? "" : lines.back(), nullptr, false);
}

std::string small_scene(const std::string& more) {
  const bool names_model = more.find("[model]") != std::string::npos;
  return "[tissue]\npoints = 3000\nphantom_surface_vertices = 400\n[server]\nport = 0\n" + more +
         (names_model ? "" : "\n[model]\nkernel = \"psi31\"\n");
}

std::string short_insertion(double duration_s) {
  const auto at = [](double x, double z) { return RigidTransform{Mat3::Identity(), Vec3(x, -4, z)}; };
  std::ostringstream text;
  write_trajectory(text, Trajectory({{0, at(8, -40)},
                                     {0.4 * duration_s, at(8, 10)},
                                     {0.5 * duration_s, at(9, 10)},
                                     {0.6 * duration_s, at(8, 10)},
                                     {duration_s, at(8, -40)}}));
  return text.str();
}

std::string octahedron_stl(double size) {
  std::ostringstream text;
  text << "solid octahedron\n";
  for (int octant = 0; octant < 8; ++octant) {
    const double x = octant & 1 ? -size : size, y = octant & 2 ? -size : size, z = octant & 4 ? -size : size;
    const bool mirrored = x * y * z < 0;
    text << "facet normal 0 0 0\nouter loop\nvertex " << x << " 0 0\n";
    if (mirrored)
      text << "vertex 0 0 " << z << "\nvertex 0 " << y << " 0\n";
    else
      text << "vertex 0 " << y << " 0\nvertex 0 0 " << z << "\n";
    text << "endloop\nendfacet\n";
  }
  text << "endsolid octahedron\n";
  return text.str();
}

}  // namespace brachy::test
