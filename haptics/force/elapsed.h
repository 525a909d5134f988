#pragma once

#include <cstdint>

namespace brachy {

/// From `from_ns` to `to_ns`, ≥ 0: 0 where the time goes backwards, INT64_MAX where the difference of extreme stamps
/// cannot be represented. Real-time: O(1).
inline std::int64_t elapsed_ns(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  std::int64_t difference = 0;
  if (to_ns <= from_ns) return 0;
  return __builtin_sub_overflow(to_ns, from_ns, &difference) ? INT64_MAX : difference;
}

}  // namespace brachy
