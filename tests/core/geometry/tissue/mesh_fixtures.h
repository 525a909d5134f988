#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "core/base/error.h"
#include "core/geometry/surface/surface_mesh.h"

namespace brachy::test {

/// The box lo … hi as 12 outward triangles.
inline SurfaceMesh make_box(const Vec3& lo, const Vec3& hi) {
  SurfaceMesh box;
  for (int i = 0; i < 8; ++i) {
    box.vertices.emplace_back(i & 1 ? hi.x() : lo.x(), i & 2 ? hi.y() : lo.y(), i & 4 ? hi.z() : lo.z());
  }
  box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return box;
}

inline SurfaceMesh joined(SurfaceMesh a, const SurfaceMesh& b) {
  const auto base = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  return a;
}

inline void turn_inside_out(SurfaceMesh& mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

inline double signed_volume(const SurfaceMesh& mesh) {
  double volume = 0;
  for (const Triangle& t : mesh.triangles) {
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
  }
  return volume;
}

/// A temporary file of this test process, removed at the end.
class TempFile {
 public:
  TempFile(const std::string& name, const std::string& bytes) : path_(fresh_path(name)) { write(bytes); }
  explicit TempFile(const std::string& name) : path_(fresh_path(name)) {}
  ~TempFile() { std::filesystem::remove_all(path_); }
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;

  void write(const std::string& bytes) const {
    std::filesystem::remove(path_);  // ext4 flushes a file that is cut and written again
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  std::string read() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  static std::filesystem::path fresh_path(const std::string& name) {
    static int count = 0;
    return std::filesystem::temp_directory_path() /
           ("brachy_tissue_" + std::to_string(::getpid()) + "_" + std::to_string(count++) + "_" + name);
  }
  std::filesystem::path path_;
};

/// The message of the UserError that `act` must throw, checked to be one line; empty, and a failure, without one.
inline std::string user_error(const std::function<void()>& act) {
  try {
    act();
  } catch (const UserError& error) {
    const std::string message = error.what();
    EXPECT_FALSE(message.empty());
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
  ADD_FAILURE() << "no UserError";
  return {};
}

template <class T>
void append_bytes(std::string& bytes, T value, bool big_endian = false) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  if (big_endian) std::reverse(raw, raw + sizeof value);
  bytes.append(raw, sizeof value);
}

inline std::string binary_stl(const SurfaceMesh& mesh) {
  std::string bytes(80, ' ');
  append_bytes(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    bytes.append(12, '\0');
    for (const std::uint32_t v : t) {
      for (int k = 0; k < 3; ++k) append_bytes(bytes, static_cast<float>(mesh.vertices[v][k]));
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

inline std::string text_stl(const SurfaceMesh& mesh) {
  std::string text = "solid box\n";
  for (const Triangle& t : mesh.triangles) {
    text += " facet normal 0 0 1\n  outer loop\n";
    for (const std::uint32_t v : t) {
      const Vec3& p = mesh.vertices[v];
      text += "   vertex " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " +
              std::to_string(p.z()) + "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid box\n";
}

inline std::string text_obj(const SurfaceMesh& mesh) {
  std::string text = "# box\no box\n";
  for (const Vec3& p : mesh.vertices) {
    text += "v " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
  }
  for (const Triangle& t : mesh.triangles) {
    text += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " +
            std::to_string(t[2] + 1) + "\n";
  }
  return text;
}

inline std::string ply(const SurfaceMesh& mesh, const std::string& format) {
  const bool text = format == "ascii", big = format == "binary_big_endian";
  std::string bytes =
      "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
      std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3& p : mesh.vertices) {
    if (text)
      bytes += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
    for (int k = 0; k < 3 && !text; ++k) append_bytes(bytes, static_cast<float>(p[k]), big);
  }
  for (const Triangle& t : mesh.triangles) {
    if (text) {
      bytes += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
    } else {
      bytes += '\3';
      for (const std::uint32_t v : t) append_bytes(bytes, static_cast<std::int32_t>(v), big);
    }
  }
  return bytes;
}

}  // namespace brachy::test
