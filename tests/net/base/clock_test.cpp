// The clocks that net takes its time from: the real one and the one that tests move.
#include "net/base/clock.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "tests/net/manual_clock.h"

namespace brachy::net::test {
namespace {

using std::chrono::milliseconds;

struct ManualClockTest : ::testing::Test {
  /// What has expired after `time`.
  std::string after(milliseconds time) {
    clock.advance(time);
    io.restart();
    io.poll();
    return expired;
  }
  auto note(const char* name) {
    return [this, name] { expired += name; };
  }

  ManualClock clock;
  boost::asio::io_context io;
  std::string expired;
  std::unique_ptr<Timer> a = clock.make_timer(io), b = clock.make_timer(io);
};

TEST_F(ManualClockTest, TimersExpireOnceAtTheirTimeAndInTheirOrder) {
  a->start(milliseconds(20), note("a"));
  b->start(milliseconds(10), note("b"));
  EXPECT_EQ(after(milliseconds(9)), "");
  EXPECT_EQ(after(milliseconds(11)), "ba");
  EXPECT_EQ(after(milliseconds(100)), "ba");
  EXPECT_EQ(clock.now_ns() - ManualClock::kBeginNs, in_ns(milliseconds(120)));
  EXPECT_EQ(clock.utc_ns() - ManualClock::kUtcBeginNs, in_ns(milliseconds(120)));
}

TEST_F(ManualClockTest, AnotherStartReplacesTheFirst) {
  a->start(milliseconds(10), note("1"));
  a->start(milliseconds(20), note("2"));
  EXPECT_EQ(after(milliseconds(15)), "");
  EXPECT_EQ(after(milliseconds(5)), "2");
}

TEST_F(ManualClockTest, WhatIsCancelledAfterItWasDueDoesNotExpire) {
  a->start(milliseconds(10), note("a"));
  b->start(milliseconds(10), note("b"));
  clock.advance(milliseconds(10));  // posted, not called yet
  a->cancel();
  b.reset();
  EXPECT_EQ(after(milliseconds(0)), "");
}

TEST_F(ManualClockTest, ATimerThatIsWaitedForIsWork) {
  a->start(milliseconds(10), [] {});
  io.poll();
  EXPECT_FALSE(io.stopped());
  after(milliseconds(10));
  EXPECT_TRUE(io.stopped());
}

TEST_F(ManualClockTest, AnIoContextThatEndsDropsWhatWaits) {
  const auto owned = std::make_shared<int>(0);
  {
    boost::asio::io_context other;
    const auto timer = clock.make_timer(other);
    timer->start(milliseconds(10), [owned] {});
    EXPECT_EQ(owned.use_count(), 2);
  }
  EXPECT_EQ(owned.use_count(), 1);
  EXPECT_EQ(after(milliseconds(10)), "");
}

TEST(RealClock, ATimerThatIsCancelledAfterItWasDueDoesNotExpire) {
  boost::asio::io_context io;
  int expired = 0;
  const auto count = [&] { ++expired; };
  const auto first = real_clock().make_timer(io), second = real_clock().make_timer(io);
  auto third = real_clock().make_timer(io);
  // In the order of their start: the first finds the others already queued.
  first->start(std::chrono::nanoseconds(0), [&] {
    second->cancel();
    third.reset();
  });
  second->start(std::chrono::nanoseconds(0), count);
  third->start(std::chrono::nanoseconds(0), count);
  io.run();
  EXPECT_EQ(expired, 0);
  second->start(std::chrono::nanoseconds(0), count);
  io.restart();
  io.run();
  EXPECT_EQ(expired, 1);
}

TEST(RealClock, ATimerThatStartsItselfAgainEndsWithTheCancel) {
  boost::asio::io_context io;
  const auto repeated = real_clock().make_timer(io), end = real_clock().make_timer(io);
  int turns = 0, after_end = 0;
  bool is_over = false;
  std::function<void()> again = [&] {
    after_end += is_over;
    repeated->start(std::chrono::nanoseconds(0), again);
    if (++turns == 10)
      end->start(std::chrono::nanoseconds(0), [&] {
        is_over = true;
        repeated->cancel();
      });
  };
  again();
  io.run();  // returns: nothing is waited for
  EXPECT_TRUE(is_over);
  EXPECT_EQ(after_end, 0);
}

TEST(RealClock, AnotherStartReplacesTheFirst) {
  boost::asio::io_context io;
  const auto timer = real_clock().make_timer(io);
  int calls = 0;
  timer->start(std::chrono::nanoseconds(0), [&] { calls += 1; });
  timer->start(std::chrono::nanoseconds(0), [&] { calls += 10; });
  io.run();
  EXPECT_EQ(calls, 10);
}

}  // namespace
}  // namespace brachy::net::test
