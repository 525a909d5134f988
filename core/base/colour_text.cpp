#include "core/base/colour_text.h"

#include <charconv>
#include <cstdio>

namespace brachy {

std::string colour_text(const Rgb& colour) {
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", colour[0], colour[1], colour[2]);
  return text;
}

std::optional<Rgb> colour_from(std::string_view text) {
  if (text.size() != 7 || text.front() != '#') return std::nullopt;
  Rgb colour{};
  for (std::size_t n = 0; n < 3; ++n) {
    const char* digits = text.data() + 1 + 2 * n;
    const auto [end, error] = std::from_chars(digits, digits + 2, colour[n], 16);
    if (error != std::errc() || end != digits + 2) return std::nullopt;
  }
  return colour;
}

Rgb distinct_colour(std::size_t n) {
  static constexpr std::array<Rgb, 7> kColours = {{{213, 94, 0},
                                                   {240, 228, 66},
                                                   {0, 158, 115},
                                                   {86, 180, 233},
                                                   {204, 121, 167},
                                                   {230, 159, 0},
                                                   {0, 114, 178}}};
  return kColours[n % kColours.size()];
}

}  // namespace brachy
