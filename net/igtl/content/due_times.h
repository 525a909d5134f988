#pragma once

#include <algorithm>
#include <cstdint>

namespace brachy::net::igtl {

/// When something periodic is due, asked at the ticks of a coarser clock. Due times are a period apart whatever the
/// times of the ticks are, so the mean rate is exact: one that no tick hits is met by the nearest, one that was missed
/// by the next. Only one that is more than a period late is left out and counted. One thread; no clock.
class DueTimes {
 public:
  /// `tick_ns`: the usual time between two ticks. Of a shorter period each tick is due.
  DueTimes(std::int64_t period_ns, std::int64_t tick_ns)
      : period_ns_(std::max(period_ns, tick_ns)), early_ns_(tick_ns / 2), is_each_(period_ns <= tick_ns) {}

  /// Whether one is due at the tick of `now_ns`, which is after those before; then the next one begins to wait.
  bool pass(std::int64_t now_ns) {
    if (is_each_) return true;
    // At first, and where the clock was set back.
    if (!is_begun_ || now_ns < due_ns_ - period_ns_ - early_ns_) due_ns_ = now_ns;
    is_begun_ = true;
    if (now_ns < due_ns_ - early_ns_) return false;
    if (const std::int64_t late_ns = now_ns - due_ns_; late_ns > period_ns_) {
      const std::int64_t left_out = (late_ns - 1) / period_ns_;
      missed_ += static_cast<std::uint64_t>(left_out);
      due_ns_ += left_out * period_ns_;
    }
    due_ns_ += period_ns_;
    return true;
  }

  std::uint64_t missed() const { return missed_; }  ///< left out so far

 private:
  std::int64_t period_ns_, early_ns_;
  bool is_each_;
  bool is_begun_ = false;
  std::int64_t due_ns_ = 0;
  std::uint64_t missed_ = 0;
};

}  // namespace brachy::net::igtl
