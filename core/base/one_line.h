#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <utility>

namespace brachy {

/// Makes untrusted text safe to quote in a message: control characters become spaces.
inline std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return text;
}

/// one_line() of its first `longest` bytes, for text of any length.
inline std::string one_short_line(std::string text, std::size_t longest = 80) {
  if (text.size() <= longest) return one_line(std::move(text));
  return one_line(text.substr(0, longest)) + "…";
}

}  // namespace brachy
