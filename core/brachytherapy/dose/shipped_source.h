#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace brachy {

/// A file of config/sources that is part of the library.
struct ShippedSource {
  std::string_view file, text;
};

/// In the order of SourceModel, from kIsoRayCs1 on.
inline constexpr std::size_t kShippedSourceCount = 8;
extern const std::array<ShippedSource, kShippedSourceCount> kShippedSources;

}  // namespace brachy
