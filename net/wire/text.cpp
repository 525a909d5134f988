#include "net/wire/text.h"

#include "core/base/utf8.h"

namespace brachy::net {

bool is_wire_text(std::string_view s) {
  return is_printable(s);
}

std::string to_wire_text(std::string_view s, std::size_t max_bytes) {
  std::string clean;
  while (!s.empty()) {
    const std::size_t size = printable_size(s);
    if (clean.size() + (size ? size : 1) > max_bytes) break;
    if (size) {
      clean.append(s.substr(0, size));
    } else {
      clean.push_back('?');
    }
    s.remove_prefix(size ? size : 1);
  }
  return clean;
}

}  // namespace brachy::net
