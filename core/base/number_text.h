#pragma once

#include <string>

namespace brachy {

/// A number as text for messages: six significant digits.
std::string text_of(double v);

/// The shortest text that reads back as the same bits; fits TOML, JSON and CSV where v is finite.
std::string exact_text(double v);

}  // namespace brachy
