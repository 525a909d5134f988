#include "core/scene/file/key.h"

#include <limits>

#include "core/base/number_text.h"

namespace brachy {

std::string toml_text(double v) {
  const std::string six_digits = text_of(v);
  return std::stod(six_digits) == v ? six_digits : exact_text(v);
}

std::string toml_text(std::int64_t v) {
  return std::to_string(v);
}

std::string toml_text(bool v) {
  return v ? "true" : "false";
}

std::string toml_text(const std::string& v) {
  std::string out = "\"";
  for (const char c : v) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string toml_text(const Vec3& v) {
  return std::string("[") + toml_text(v[0]) + ", " + toml_text(v[1]) + ", " + toml_text(v[2]) + "]";
}

std::string toml_text(const std::vector<std::string>& v) {
  std::string out = "[";
  out += range_text(v);
  return out + "]";
}

std::string range_text(const Range& range) {
  return text_of(range.least) + " … " + text_of(range.most);
}

std::string range_text(const IntegerRange& range) {
  if (range.most == std::numeric_limits<std::int64_t>::max()) return std::to_string(range.least) + " or more";
  return std::to_string(range.least) + " … " + std::to_string(range.most);
}

std::string range_text(const std::vector<std::string>& allowed) {
  std::string out;
  for (const std::string& value : allowed) out += (out.empty() ? "" : ", ") + toml_text(value);
  return out;
}

}  // namespace brachy
