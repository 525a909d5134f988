#pragma once

#include <optional>
#include <string>

namespace brachy {

/// One of the parts of a long run that machines share: slice 2 of 8 is "2/8".
struct Slice {
  int index = 1, count = 1;  ///< 1 ≤ index ≤ count
};

constexpr int kMostSlices = 100'000;

/// "I/N" as a slice; nothing for any other text.
std::optional<Slice> find_slice(const std::string& text);
std::string to_string(const Slice& slice);

}  // namespace brachy
