#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/geometry/mesh_io/mesh_precheck.h"
#include "core/geometry/mesh_io/mesh_words.h"

namespace brachy {
namespace {

struct PlyProperty {
  std::string name;
  std::size_t size = 0;        ///< bytes of the value, or of one list entry
  std::size_t count_size = 0;  ///< bytes of a list's count, 0 for a scalar
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  bool has(std::string_view property, bool list) const {
    return std::any_of(properties.begin(), properties.end(), [&](const PlyProperty& p) {
      return p.name == property && (p.count_size > 0) == list;
    });
  }
};

struct PlyHeader {
  bool ascii = false, big_endian = false;
  std::vector<PlyElement> elements;
};

std::size_t ply_type_size(std::string_view type, const std::string& name) {
  for (const auto* t : {"char", "uchar", "int8", "uint8"})
    if (type == t) return 1;
  for (const auto* t : {"short", "ushort", "int16", "uint16"})
    if (type == t) return 2;
  for (const auto* t : {"int", "uint", "float", "int32", "uint32", "float32"})
    if (type == t) return 4;
  for (const auto* t : {"double", "float64"})
    if (type == t) return 8;
  throw UserError(name + ": PLY header has an unknown property type; export the mesh again");
}

constexpr std::size_t kMaxElements = 32, kMaxProperties = 256, kMaxHeaderLines = 10'000;

[[noreturn]] void too_long(const std::string& name) {
  throw UserError(name + ": PLY header is longer than that of any mesh; export the mesh again");
}

/// Reads the header and advances `text` to the data.
PlyHeader read_ply_header(std::string_view& text, const std::string& name) {
  PlyHeader header;
  bool has_format = false;
  for (std::size_t line_number = 1;; ++line_number) {
    if (text.find('\n') == std::string_view::npos) {
      throw UserError(name + ": PLY header is truncated; export the mesh again");
    }
    if (line_number > kMaxHeaderLines) too_long(name);
    std::string_view line = next_line(text);
    const std::string_view keyword = next_word(line);
    if (line_number == 1 && keyword != "ply")
      throw UserError(name + ": is not a PLY file; export the mesh again as PLY");
    if (keyword == "end_header") break;
    if (keyword == "format") {
      const std::string_view format = next_word(line);
      header.ascii = format == "ascii";
      header.big_endian = format == "binary_big_endian";
      has_format = header.ascii || header.big_endian || format == "binary_little_endian";
    } else if (keyword == "element") {
      if (header.elements.size() == kMaxElements) too_long(name);
      PlyElement element{std::string(next_word(line)), 0, {}};
      const auto count = to_count(next_word(line));
      // An entry takes a byte at least; this also keeps the sums below from overflowing.
      if (!count || *count > text.size()) {
        throw UserError(
            name +
            ": PLY header declares more entries than the file can hold, or an unreadable count (line " +
            std::to_string(line_number) + "); it is truncated or damaged, export the mesh again");
      }
      element.count = *count;
      header.elements.push_back(std::move(element));
    } else if (keyword == "property" && !header.elements.empty()) {
      if (header.elements.back().properties.size() == kMaxProperties) too_long(name);
      std::string_view type = next_word(line);
      PlyProperty property;
      if (type == "list") {
        property.count_size = ply_type_size(next_word(line), name);
        type = next_word(line);
      }
      property.size = ply_type_size(type, name);
      property.name = next_word(line);
      header.elements.back().properties.push_back(property);
    } else if (line_number > 1 && keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      // assimp may interpret a line that is skipped here.
      throw UserError(name + ": line " + std::to_string(line_number) +
                      " of the PLY header begins with no keyword of that format; export the mesh again");
    }
  }
  if (!has_format) throw UserError(name + ": PLY header names no known format; export the mesh again");
  return header;
}

/// Advances `data` past one binary property; false where it ends too soon.
bool skip_binary(std::string_view& data, const PlyProperty& property, bool big_endian) {
  std::uint64_t count = 1;
  if (property.count_size > 0) {
    if (data.size() < property.count_size) return false;
    count = 0;
    for (std::size_t k = 0; k < property.count_size; ++k) {
      const std::size_t byte = big_endian ? k : property.count_size - 1 - k;
      count = count << 8 | static_cast<unsigned char>(data[byte]);
    }
    data.remove_prefix(property.count_size);
  }
  if (count > data.size() / property.size) return false;
  data.remove_prefix(count * property.size);
  return true;
}

bool skip_ascii(std::string_view& data, const PlyProperty& property) {
  std::uint64_t count = 1;
  if (property.count_size > 0) {
    const auto declared = to_count(next_word(data));
    if (!declared || *declared > data.size()) return false;
    count = *declared;
  }
  for (std::uint64_t k = 0; k < count; ++k) {
    if (!is_number(next_word(data))) return false;
  }
  return true;
}

/// Checks that the elements of a surface are there, in the order that assimp requires.
void check_elements(const PlyHeader& header, const std::string& name) {
  const auto find = [&](std::string_view element) {
    return std::find_if(header.elements.begin(), header.elements.end(),
                        [&](const PlyElement& e) { return e.name == element && e.count > 0; });
  };
  const auto vertex = find("vertex"), face = find("face");
  if (vertex == header.elements.end()) throw UserError(name + ": has no vertices; export a surface mesh");
  // Without faces assimp would form a triangle from every three points.
  if (face == header.elements.end())
    throw UserError(name + ": has no faces (a point cloud?); export a surface mesh");
  const bool placed = vertex->has("x", false) && vertex->has("y", false) && vertex->has("z", false);
  const bool indexed = face->has("vertex_indices", true) || face->has("vertex_index", true);
  if (!placed || !indexed || face < vertex) {
    throw UserError(
        name +
        ": PLY header lacks vertices with x, y, z, then faces with a list of vertex_indices; export the "
        "mesh again");
  }
}

}  // namespace

void check_ply_bytes(std::string_view bytes, const std::string& name) {
  std::string_view data = bytes;
  const PlyHeader header = read_ply_header(data, name);
  check_elements(header, name);
  for (const PlyElement& element : header.elements) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& property : element.properties) {
        if (header.ascii ? skip_ascii(data, property) : skip_binary(data, property, header.big_endian))
          continue;
        throw UserError(name + ": ends or cannot be read within " + one_short_line(element.name) + " " +
                        std::to_string(i) + " of " + std::to_string(element.count) +
                        "; it is truncated or damaged, export the mesh again");
      }
    }
  }
}

void keep_first_byte(std::string& ply) {
  std::string_view data = ply;
  const PlyHeader header = read_ply_header(data, "PLY");
  if (!header.ascii && data.starts_with('\n')) ply.insert(ply.size() - data.size(), 1, '\n');
}

}  // namespace brachy
