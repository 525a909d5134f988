// The daemon's timers: what is cancelled does not come, or the event loop would never run dry.
#include "apps/daemon/io/event_loop.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>

namespace brachy {
namespace {

TEST(EventLoopTimer, ACancelledCallDoesNotComeEvenIfItIsDueAlready) {
  EventLoop loop;
  Timer first(loop), second(loop);
  const Timer::Clock::time_point now = Timer::Clock::now();
  int calls = 0;
  const auto cancel_the_other = [&](Timer& other) {
    return [&] {
      ++calls;
      other.cancel();
    };
  };
  first.start_at(now, cancel_the_other(second));  // both are due when the loop looks first
  second.start_at(now, cancel_the_other(first));
  loop.run();
  EXPECT_EQ(calls, 1);
}

TEST(EventLoopTimer, ACallThatComesAgainEndsWithTheCancel) {
  EventLoop loop;
  Timer repeated(loop), end(loop);
  const Timer::Clock::time_point now = Timer::Clock::now();
  int after_end = -1;
  std::function<void()> again = [&] {
    if (after_end >= 0) ++after_end;
    repeated.start_at(now, again);
  };
  end.start_at(now - std::chrono::milliseconds(1), [&] {
    after_end = 0;
    repeated.cancel();
  });
  again();
  loop.run();  // returns: nothing is waited for
  EXPECT_EQ(after_end, 0);
}

TEST(EventLoopTimer, NoCallComesAfterTheTimersEnd) {
  EventLoop loop;
  auto timer = std::make_unique<Timer>(loop);
  Timer end(loop);
  const Timer::Clock::time_point now = Timer::Clock::now();
  int calls = 0;
  end.start_at(now - std::chrono::milliseconds(1), [&] { timer.reset(); });
  timer->start_at(now, [&] { ++calls; });
  loop.run();
  EXPECT_EQ(calls, 0);
}

TEST(EventLoopTimer, AnotherTimeReplacesTheOneBefore) {
  EventLoop loop;
  Timer timer(loop);
  int calls = 0;
  timer.start_at(Timer::Clock::now(), [&] { calls += 1; });
  timer.start_at(Timer::Clock::now(), [&] { calls += 10; });
  loop.run();
  EXPECT_EQ(calls, 10);
}

}  // namespace
}  // namespace brachy
