#pragma once

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

// Parts of .vtp files (VTK XML PolyData with raw appended blocks) and .pvd collections.

static_assert(std::endian::native == std::endian::little, "the .vtp files say LittleEndian");

inline constexpr std::string_view kVtpHead =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
    "header_type=\"UInt64\">\n<PolyData>\n";

inline constexpr std::string_view kPvdHead =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
    "  <Collection>\n";
inline constexpr std::string_view kPvdTail = "  </Collection>\n</VTKFile>\n";

/// The raw blocks behind <AppendedData>: each a byte count and its bytes. add() returns its offset.
class VtpBlocks {
 public:
  template <class T>
  std::size_t add(const std::vector<T>& values) {
    const std::size_t offset = data_.size();
    const std::uint64_t bytes = values.size() * sizeof(T);
    append(&bytes, sizeof bytes);
    append(values.data(), bytes);
    return offset;
  }
  const std::string& data() const { return data_; }

 private:
  void append(const void* bytes, std::size_t count) { data_.append(static_cast<const char*>(bytes), count); }
  std::string data_;
};

inline std::string vtp_tail(const VtpBlocks& blocks) {
  return "</PolyData>\n<AppendedData encoding=\"raw\">\n_" + blocks.data() +
         "\n</AppendedData>\n</VTKFile>\n";
}

inline std::string vtp_array(const char* type, const char* name, int components, std::size_t offset) {
  return fmt::format(
      R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>)", type, name,
      components, offset);
}

/// Where each of `count` cells of `stride` points ends.
inline std::vector<std::int32_t> vtp_offsets(std::size_t count, std::int32_t stride) {
  std::vector<std::int32_t> result(count);
  for (std::size_t i = 0; i < count; ++i) result[i] = static_cast<std::int32_t>(i + 1) * stride;
  return result;
}

inline std::vector<std::int32_t> vtp_corners(const std::vector<Triangle>& triangles) {
  std::vector<std::int32_t> corners;
  for (const Triangle& t : triangles)
    for (const std::uint32_t corner : t) corners.push_back(static_cast<std::int32_t>(corner));
  return corners;
}

}  // namespace brachy
