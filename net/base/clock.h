#pragma once

#include <time.h>

#include <chrono>
#include <cstdint>

#include "core/realtime/deadline.h"  // monotonic_ns, the clock of TickSummary::publish_ns

namespace brachy::net {

inline std::int64_t in_ns(std::chrono::milliseconds duration) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

/// Processor time of this thread: what work costs, whatever else runs on the machine.
inline std::int64_t thread_cpu_ns() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::int64_t{1'000'000'000} * time.tv_sec + time.tv_nsec;
}

}  // namespace brachy::net
