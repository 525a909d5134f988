#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "net/base/clock.h"

namespace brachy::net {

/// Schedules the checks of timeouts: every kPeriod, as of the time after the next check, so that none is exceeded. A
/// check that is far too late, because the process was stopped or had no core, is skipped once: input that arrived
/// meanwhile is read first, so that its sender does not count as silent. One thread.
class TimeoutChecks {
 public:
  static constexpr std::chrono::milliseconds kPeriod{20};
  static constexpr std::chrono::milliseconds kLate{300};

  /// Called every kPeriod. Returns the time as of which to check; nullopt: skip this check.
  std::optional<std::int64_t> as_of(std::int64_t now_ns) {
    const bool is_late = last_ns_ != 0 && now_ns - last_ns_ > in_ns(kLate);
    was_left_out_ = is_late && !was_left_out_;
    last_ns_ = now_ns;
    return was_left_out_ ? std::nullopt : std::optional(now_ns + 2 * in_ns(kPeriod));
  }

 private:
  std::int64_t last_ns_ = 0;  // 0: never
  bool was_left_out_ = false;
};

}  // namespace brachy::net
