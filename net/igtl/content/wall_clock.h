#pragma once

#include <chrono>
#include <cstdint>

namespace brachy::net::igtl {

/// Since 1970, ns: OpenIGTLink's clock.
inline std::int64_t utc_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

}  // namespace brachy::net::igtl
