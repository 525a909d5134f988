#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace brachy::net {

/// Our clock minus a sender's, from when its stamped messages arrive: the least difference of the last kWindowNs or twice that, which
/// is too large by the quickest message's way. Clocks drift: older ones are forgotten. One thread.
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
