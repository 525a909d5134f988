#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace brachy {

using Rgb = std::array<std::uint8_t, 3>;  ///< red, green, blue

/// "#rrggbb", and back; nothing where it is another text.
std::string colour_text(const Rgb& colour);
std::optional<Rgb> colour_from(std::string_view text);

/// Colours that colour-blind people can tell apart (M. Okabe, K. Ito, "Color universal design", 2008); the eighth is
/// the first again.
Rgb distinct_colour(std::size_t n);

}  // namespace brachy
