#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "net/clock.h"

namespace brachy::net {

/// When timeouts are checked: every kPeriod, as of the time after next, so that none is exceeded. A check that comes far too
/// late, because the process was stopped or got no core, is left out once: what came meanwhile is read first, and whoever
/// sent it was not silent. One thread.
class TimeoutChecks {
 public:
  static constexpr std::chrono::milliseconds kPeriod{20};
  static constexpr std::chrono::milliseconds kLate{300};

  /// To be called every kPeriod: the time as of which to check; nullopt: not this time.
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
