#pragma once

#include <cstddef>
#include <string_view>

namespace brachy {

/// Size in bytes of the printable character at the beginning of `s` (not empty): well-formed UTF-8, no control
/// character (U+0000–001F, U+007F–009F). 0 where there is none.
std::size_t printable_size(std::string_view s);

/// Whether `s` consists of printable characters only.
bool is_printable(std::string_view s);

}  // namespace brachy
