#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace brachy::net {

/// Our clock minus a sender's, from the arrival times of its stamped messages: the least difference over the last
/// kWindowNs to twice that, too large by the shortest transit time. Older ones are forgotten, since clocks drift. One
/// thread.
class ArrivalOffset {
 public:
  static constexpr std::int64_t kWindowNs = 30'000'000'000;

  void add(std::int64_t stamp_ns, std::int64_t arrived_ns) {
    if (arrived_ns - began_ns_ >= kWindowNs) {
      before_ = now_;
      now_ = kNone;
      began_ns_ = arrived_ns;
    }
    now_ = std::min(now_, arrived_ns - stamp_ns);
  }
  /// Precondition: add() was called.
  std::int64_t offset_ns() const { return std::min(before_, now_); }

 private:
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
  std::int64_t before_ = kNone, now_ = kNone;  // the least of the last window and of this one
  std::int64_t began_ns_ = 0;
};

}  // namespace brachy::net
