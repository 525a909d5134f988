#pragma once

#include <cstddef>
#include <string_view>

namespace brachy {

/// Bytes of the printable character that `s`, not empty, starts with: well-formed UTF-8, no control character (U+0000–001F,
/// U+007F–009F). 0: it starts with none.
std::size_t printable_size(std::string_view s);

/// Whether it is all printable characters.
bool is_printable(std::string_view s);

}  // namespace brachy
