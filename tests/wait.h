#pragma once

#include <algorithm>
#include <chrono>

namespace brachy::test {

/// How long a test waits for what another process or thread does. It only ends a test that would hang: no machine is so
/// busy, and no test says that something took less. What a time-out itself does is tested with a clock that the test
/// moves (tests/net/manual_clock.h), and what only the real time shows is measured by a campaign (scripts/nightly.sh).
inline constexpr std::chrono::milliseconds kDeadline{300'000};

/// How long one turn of a wait lasts where nothing happens.
inline constexpr std::chrono::milliseconds kTurn{1};

/// The end of a wait that begins with its construction.
class Deadline {
 public:
  bool has_passed() const { return Clock::now() >= end_; }
  /// For poll(2); 0: it has passed.
  int left_ms() const {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end_ - Clock::now()).count();
    return static_cast<int>(std::max<std::chrono::milliseconds::rep>(0, left));
  }

 private:
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end_ = Clock::now() + kDeadline;
};

/// Calls `take_turn`, which serves somebody or waits a moment, until `condition()` holds; false where it does not
/// before the deadline.
template <class Condition, class TakeTurn>
bool wait_until(Condition&& condition, TakeTurn&& take_turn) {
  const Deadline deadline;
  while (!condition()) {
    if (deadline.has_passed()) return false;
    take_turn();
  }
  return true;
}

}  // namespace brachy::test
