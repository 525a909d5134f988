#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace brachy::net {

/// True for well-formed UTF-8 (no overlong forms, no surrogates, at most U+10FFFF) without control characters
/// (C0, DEL, C1): texts from the network end up in terminals and logs.
bool is_wire_text(std::string_view s);

/// The longest prefix of `s` in at most `max_bytes` that is_wire_text accepts, with '?' for every byte it refuses.
std::string to_wire_text(std::string_view s, std::size_t max_bytes);

}  // namespace brachy::net
