#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

#include "core/realtime/deadline.h"  // Clock; monotonic_ns, the clock of TickSummary::publish_ns; thread_cpu_ns

namespace boost::asio {
class io_context;
}

namespace brachy::net {

inline std::int64_t in_ns(std::chrono::milliseconds duration) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

/// Calls a function once, after a time. Threads: the one that runs its io_context.
class Timer {
 public:
  virtual ~Timer() = default;  ///< as cancel()
  /// Calls `on_expiry` from the io_context, never from here, unless cancel() or another start() comes before. Until
  /// then the io_context has work and keeps what `on_expiry` owns.
  virtual void start(std::chrono::nanoseconds after, std::function<void()> on_expiry) = 0;
  virtual void cancel() = 0;
};

/// Where net takes its time from, and what waits for it: every timeout, rate and pause. Tests have one that they move
/// (tests/net/manual_clock.h). Outlives the io_contexts of its timers. Threads: any.
class TimerClock : public Clock {
 public:
  virtual std::int64_t utc_ns() = 0;  ///< since 1970
  virtual std::unique_ptr<Timer> make_timer(boost::asio::io_context& io) = 0;
};

/// monotonic_ns(), the system's wall clock and Asio's timers. Stateless; lives as long as the program.
TimerClock& real_clock();

}  // namespace brachy::net
