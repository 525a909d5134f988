#pragma once

#include <string>
#include <string_view>

namespace brachy {

/// Text for a log or a terminal: what is not printable (control characters, bytes that are no UTF-8) and the backslash
/// itself are written as in C, so that no name of a file or of a peer can forge a line or steer a terminal.
std::string escaped(std::string_view text);

}  // namespace brachy
