#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/base/error.h"
#include "core/geometry/mesh_io/mesh_precheck.h"
#include "core/geometry/mesh_io/mesh_words.h"

namespace brachy {
namespace {

constexpr std::size_t kMaxSolids = 1000;  // each becomes a mesh of its own
constexpr std::uint64_t kHeaderBytes = 84, kTriangleBytes = 50;

/// Bytes of a binary STL by its count of triangles; nothing where there is no whole header.
std::optional<std::uint64_t> binary_size(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return std::nullopt;
  std::uint64_t count = 0;
  for (std::size_t k = 4; k-- > 0;) count = count << 8 | static_cast<unsigned char>(bytes[80 + k]);
  return kHeaderBytes + kTriangleBytes * count;
}

/// Text has none before its end.
bool has_zeros(std::string_view bytes) {
  return bytes.substr(0, bytes.find_last_not_of('\0') + 1).find('\0') != std::string_view::npos;
}

char to_small(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// Whether `text` continues with these tokens; "#" stands for a number, on the same line as assimp requires.
bool reads(std::string_view& text, std::string_view words) {
  for (std::string_view wanted = next_word(words); !wanted.empty(); wanted = next_word(words)) {
    const std::size_t gap = std::min(text.find_first_not_of(" \t"), text.size());
    const bool same_line = gap < text.size() && text[gap] != '\n' && text[gap] != '\r';
    const std::string_view word = next_word(text);
    if (wanted == "#" ? !same_line || !is_number(word) : word != wanted) return false;
  }
  return true;
}

void check_text(std::string_view text, const std::string& name) {
  std::size_t facets = 0, solids = 0;
  for (std::string_view word = next_word(text); !word.empty(); word = next_word(text)) {
    if (word == "solid") {
      if (++solids > kMaxSolids)
        throw UserError(name + ": text STL with more than " + std::to_string(kMaxSolids) +
                        " solids; export the surface as one");
      next_line(text);  // its name
      for (word = next_word(text); word == "facet"; word = next_word(text), ++facets) {
        const bool whole =
            reads(text, "normal # # # outer loop vertex # # # vertex # # # vertex # # # endloop endfacet");
        if (whole) continue;
        throw UserError(name + ": facet " + std::to_string(facets) +
                        " of this text STL is truncated or damaged; export the mesh again");
      }
    }
    if (word != "endsolid") {
      throw UserError(name + ": text STL without 'endsolid' after facet " + std::to_string(facets) +
                      ", so it is truncated or damaged; export the mesh again");
    }
    next_line(text);
  }
}

}  // namespace

void make_stl_plain(std::string& bytes) {
  constexpr std::string_view kFilling("\0 \t\r\n\x1a", 6);
  if (const auto whole = binary_size(bytes); whole && *whole <= bytes.size() && has_zeros(bytes)) {
    const std::string_view behind = std::string_view(bytes).substr(*whole);
    if (behind.size() < kTriangleBytes || behind.find_first_not_of(kFilling) == std::string_view::npos)
      bytes.resize(*whole);
    return;
  }
  std::string_view text = bytes;
  std::string word(next_word(text));
  std::ranges::transform(word, word.begin(), to_small);
  if (word != "solid") return;
  bytes.erase(0, bytes.find_first_not_of(" \t\r\n"));
  while (!bytes.empty() && kFilling.find(bytes.back()) != std::string_view::npos) bytes.pop_back();
  bytes += '\n';
  std::ranges::transform(bytes, bytes.begin(), to_small);
}

void check_stl_bytes(std::string_view bytes, const std::string& name) {
  const std::optional<std::uint64_t> whole = binary_size(bytes);
  if (whole == bytes.size()) {
    if (*whole == kHeaderBytes) throw UserError(name + ": declares 0 triangles; export a surface mesh");
    return;
  }
  std::string_view text = bytes;
  const bool is_text = bytes.find('\0') == std::string_view::npos;
  if (is_text && next_word(text) == "solid") return check_text(bytes, name);
  if (is_text || !whole) {
    throw UserError(name +
                    ": is neither a text STL ('solid …') nor a binary one; export the mesh again as STL");
  }
  throw UserError(name + ": binary STL declares " + std::to_string((*whole - kHeaderBytes) / kTriangleBytes) +
                  " triangles, i.e. " + std::to_string(*whole) + " bytes, but has " +
                  std::to_string(bytes.size()) + "; it is truncated or damaged, export the mesh again");
}

void keep_surface_lines(std::string& obj) {
  bool is_dropped = false, is_continued = false;
  for (std::size_t begin = 0; begin < obj.size();) {
    const std::size_t end = std::min(obj.find('\n', begin), obj.size());
    std::string_view line(obj.data() + begin, end - begin);
    if (!is_continued) {
      std::string_view rest = line;
      const std::string_view word = next_word(rest);
      is_dropped = word != "v" && word != "vt" && word != "vn" && word != "f";
    }
    while (line.ends_with('\r') || line.ends_with(' ')) line.remove_suffix(1);
    is_continued = line.ends_with('\\');
    if (is_dropped) std::fill_n(obj.begin() + static_cast<std::ptrdiff_t>(begin), end - begin, ' ');
    begin = end + 1;
  }
}

void check_obj_bytes(std::string_view bytes, const std::string& name) {
  if (bytes.find('\0') == std::string_view::npos) return;
  throw UserError(name + ": is not an OBJ file (not text); export the mesh again as OBJ");
}

}  // namespace brachy
