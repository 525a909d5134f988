#pragma once

#include <cstdint>

namespace brachy {

inline constexpr std::int64_t kMs = 1'000'000;  ///< in nanoseconds, as devices count

}  // namespace brachy
