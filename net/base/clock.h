#pragma once

#include <chrono>
#include <cstdint>

#include "core/realtime/deadline.h"  // monotonic_ns, the clock of TickSummary::publish_ns; thread_cpu_ns

namespace brachy::net {

inline std::int64_t in_ns(std::chrono::milliseconds duration) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

}  // namespace brachy::net
