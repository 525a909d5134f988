#include "core/realtime/deadline.h"

#include <time.h>

#include <cassert>

namespace brachy {

namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

class MonotonicClock final : public Clock {
 public:
  std::int64_t now_ns() override { return monotonic_ns(); }

  void sleep_until_ns(std::int64_t deadline_ns) override {
    if (deadline_ns <= 0) return;
    const timespec until{deadline_ns / kNsPerSecond, deadline_ns % kNsPerSecond};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
  }
};

}  // namespace

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerSecond + now.tv_nsec;
}

std::int64_t thread_cpu_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return now.tv_sec * kNsPerSecond + now.tv_nsec;
}

Clock& monotonic_clock() {
  static MonotonicClock clock;
  return clock;
}

DeadlineTimer::DeadlineTimer(std::int64_t period_ns, std::int64_t start_ns, Clock& clock)
    : clock_(&clock), period_ns_(period_ns), next_ns_(start_ns) {
  assert(period_ns > 0);
}

std::int64_t DeadlineTimer::wait() {
  std::int64_t now = clock_->now_ns();
  if (now > next_ns_) {
    const std::int64_t missed = 1 + (now - next_ns_ - 1) / period_ns_;  // deadlines before now
    overruns_ += static_cast<std::uint64_t>(missed);
    next_ns_ += missed * period_ns_;
  }
  while (now < next_ns_) {  // a signal ends a wait early
    clock_->sleep_until_ns(next_ns_);
    now = clock_->now_ns();
  }
  next_ns_ += period_ns_;
  return now - deadline_ns();
}

}  // namespace brachy
