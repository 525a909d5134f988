#include "apps/lab/slices/slice.h"

#include <charconv>

namespace brachy {

std::optional<Slice> find_slice(const std::string& text) {
  const auto number = [](const char* from, const char* to, int& value) {
    const auto [end, error] = std::from_chars(from, to, value);
    return error == std::errc() && end == to && *from != '-';
  };
  const auto bar = text.find('/');
  if (bar == std::string::npos) return std::nullopt;
  Slice slice;
  if (!number(text.data(), text.data() + bar, slice.index) ||
      !number(text.data() + bar + 1, text.data() + text.size(), slice.count))
    return std::nullopt;
  if (slice.index < 1 || slice.index > slice.count || slice.count > kMostSlices) return std::nullopt;
  return slice;
}

std::string to_string(const Slice& slice) {
  return std::to_string(slice.index) + "/" + std::to_string(slice.count);
}

}  // namespace brachy
