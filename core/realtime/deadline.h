#pragma once

#include <cstdint>

namespace brachy {

/// A clock to wait on; tests substitute their own.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t now_ns() = 0;
  /// Sleeps until the clock shows deadline_ns; may return early (a signal). Returns at once if it has passed.
  virtual void sleep_until_ns(std::int64_t deadline_ns) = 0;
};

/// CLOCK_MONOTONIC, ns: does not jump when the wall clock is set.
///
/// Threads: any.
///
/// Real-time: a vDSO call.
std::int64_t monotonic_ns();

/// CLOCK_THREAD_CPUTIME_ID, ns: the processor time of this thread, which is what work costs, whatever else runs on the
/// machine.
///
/// Threads: any, each with its own.
///
/// Real-time: a system call.
std::int64_t thread_cpu_ns();

/// CLOCK_MONOTONIC with clock_nanosleep(TIMER_ABSTIME). Stateless; lives as long as the program.
Clock& monotonic_clock();

/// Absolute deadlines start, start + period, start + 2 period, …
///
/// A deadline that has passed before wait is called for it is missed: it is skipped and counted, and wait
/// waits for the next one. The phase is kept, lateness does not accumulate, and there is no burst of ticks to
/// catch up. A late wake-up alone is not a miss, unless the work then runs past the next deadline.
///
/// Threads: one, the one that waits.
///
/// Real-time: no allocation, no lock; sleeps in wait.
class DeadlineTimer {
 public:
  /// period_ns > 0; start_ns is the first deadline, on the clock's time.
  DeadlineTimer(std::int64_t period_ns, std::int64_t start_ns, Clock& clock = monotonic_clock());

  /// Sleeps until the next deadline that has not passed; returns how late it woke, ns ≥ 0.
  std::int64_t wait();

  std::int64_t period_ns() const { return period_ns_; }
  /// The deadline the last wait woke for; before the first wait, start − period.
  std::int64_t deadline_ns() const { return next_ns_ - period_ns_; }
  /// Deadlines skipped since construction.
  std::uint64_t overruns() const { return overruns_; }

 private:
  Clock* clock_;
  std::int64_t period_ns_;
  std::int64_t next_ns_;
  std::uint64_t overruns_ = 0;
};

}  // namespace brachy
