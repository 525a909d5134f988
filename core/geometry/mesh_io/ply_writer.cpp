#include "core/geometry/mesh_io/ply_writer.h"

#include <array>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <system_error>

#include "core/base/error.h"

namespace brachy {
namespace {

// to_chars is independent of the locale.
void append(std::string& text, double value) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.begin(), digits.end(), value, std::chars_format::general, 17).ptr;
  text.append(digits.begin(), end);
}

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);
  throw UserError(path.string() + ": cannot be written: " + std::strerror(error ? error : EIO) +
                  "; check the folder, its permissions and the free space");
}

}  // namespace

void write_ply(const std::filesystem::path& path, const SurfaceMesh& mesh, const PlyVertexProperty& extra) {
  assert(extra.values.empty() || extra.values.size() == mesh.vertices.size());
  errno = 0;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) {
    throw UserError(path.string() + ": cannot be opened for writing: " + std::strerror(errno) +
                    "; check the folder and its permissions");
  }
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
                     "\nproperty double x\nproperty double y\nproperty double z\n";
  if (!extra.values.empty()) text += "property double " + extra.name + "\n";
  text += "element face " + std::to_string(mesh.triangles.size()) +
          "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto flush_if_long = [&] {
    if (text.size() < (1u << 20)) return;
    file.write(text.data(), static_cast<std::streamsize>(text.size()));
    text.clear();
  };
  for (std::size_t v = 0; v < mesh.vertices.size() && file; ++v) {
    for (int k = 0; k < 3; ++k) {
      if (k > 0) text += ' ';
      append(text, mesh.vertices[v][k]);
    }
    if (!extra.values.empty()) append(text += ' ', extra.values[v]);
    text += '\n';
    flush_if_long();
  }
  for (const Triangle& triangle : mesh.triangles) {
    text += '3';
    for (const std::uint32_t v : triangle) (text += ' ') += std::to_string(v);
    text += '\n';
    flush_if_long();
  }
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (!file) fail(path, errno);
}

}  // namespace brachy
