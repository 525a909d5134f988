#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace brachy {

/// Limits of a TOML file, which are checked before it is parsed: the parser and its tables recurse to the depth of a
/// file, and each key takes some hundred bytes of memory.
struct TomlLimits {
  static constexpr std::size_t kMaxBytes = 1 << 20;
  static constexpr std::size_t kMaxDepth = 8;  ///< parts of a dotted key or header; brackets and braces
  static constexpr std::size_t kMaxValues = 50'000;
};

struct TomlExcess {
  std::size_t line = 0;
  std::string what;
};

/// The first place where `text` exceeds the limits; nullopt: it may be parsed. Text that is not valid TOML is checked
/// up to its first error. O(size) time, no recursion.
std::optional<TomlExcess> find_toml_excess(std::string_view text);

}  // namespace brachy
