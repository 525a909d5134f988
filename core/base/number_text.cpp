#include "core/base/number_text.h"

#include <array>
#include <charconv>
#include <sstream>

namespace brachy {

std::string text_of(double v) {
  std::ostringstream out;
  out << v;
  return out.str();
}

std::string exact_text(double v) {
  std::array<char, 32> buffer;  // a double takes at most 24
  return {buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), v).ptr};
}

}  // namespace brachy
