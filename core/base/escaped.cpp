#include "core/base/escaped.h"

#include "core/base/utf8.h"

namespace brachy {

std::string escaped(std::string_view text) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t size = text.front() == '\\' ? 0 : printable_size(text);
    if (size > 0) {
      out.append(text.substr(0, size));
      text.remove_prefix(size);
      continue;
    }
    const auto byte = static_cast<unsigned char>(text.front());
    if (byte == '\n') {
      out += "\\n";
    } else if (byte == '\t') {
      out += "\\t";
    } else if (byte == '\\') {
      out += "\\\\";
    } else {
      out += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
    }
    text.remove_prefix(1);
  }
  return out;
}

}  // namespace brachy
