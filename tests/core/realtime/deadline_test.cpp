#include "core/realtime/deadline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <vector>

namespace brachy {
namespace {

constexpr std::int64_t kPeriod = 5'000'000;
constexpr std::int64_t kStart = 100 * kPeriod;

/// A clock that advances only in sleeps, each of which ends late (or early) as scripted.
class MockClock final : public Clock {
 public:
  std::int64_t now_ns() override { return now; }
  void sleep_until_ns(std::int64_t deadline_ns) override {
    sleeps.push_back(deadline_ns);
    std::int64_t lateness = 0;
    if (!latenesses.empty()) {
      lateness = latenesses.front();
      latenesses.pop_front();
    }
    now = std::max(now, deadline_ns + lateness);
  }

  std::int64_t now = kStart - kPeriod;
  std::deque<std::int64_t> latenesses;
  std::vector<std::int64_t> sleeps;
};

TEST(DeadlineTimer, WakesAtStartAndThenEveryPeriod) {
  MockClock clock;
  DeadlineTimer timer(kPeriod, kStart, clock);
  for (std::int64_t tick = 0; tick < 1000; ++tick) {
    EXPECT_EQ(timer.wait(), 0);
    EXPECT_EQ(clock.now, kStart + tick * kPeriod);
    EXPECT_EQ(timer.deadline_ns(), clock.now);
    clock.now += 1'000'000;  // the tick's work
  }
  EXPECT_EQ(timer.overruns(), 0u);
}

TEST(DeadlineTimer, LatenessIsReportedAndDoesNotShiftLaterDeadlines) {
  MockClock clock;
  clock.latenesses = {70'000, 0, 2'000'000, 30'000};
  DeadlineTimer timer(kPeriod, kStart, clock);
  EXPECT_EQ(timer.wait(), 70'000);
  EXPECT_EQ(timer.wait(), 0);
  EXPECT_EQ(timer.wait(), 2'000'000);
  EXPECT_EQ(timer.wait(), 30'000);
  EXPECT_EQ(clock.sleeps, (std::vector<std::int64_t>{kStart, kStart + kPeriod, kStart + 2 * kPeriod,
                                                     kStart + 3 * kPeriod}));
  EXPECT_EQ(timer.overruns(), 0u);
}

TEST(DeadlineTimer, ATickThatRunsOverItsPeriodSkipsTheMissedDeadline) {
  MockClock clock;
  DeadlineTimer timer(kPeriod, kStart, clock);
  timer.wait();
  clock.now += kPeriod + 1;
  EXPECT_EQ(timer.wait(), 0);
  EXPECT_EQ(clock.now, kStart + 2 * kPeriod);
  EXPECT_EQ(timer.overruns(), 1u);
}

TEST(DeadlineTimer, ALongStallIsCountedAndNotCaughtUpInABurst) {
  MockClock clock;
  DeadlineTimer timer(kPeriod, kStart, clock);
  timer.wait();
  clock.now += 400 * kPeriod + 123;  // SIGSTOP for 2 s
  EXPECT_EQ(timer.wait(), 0);
  EXPECT_EQ(timer.overruns(), 400u);
  EXPECT_EQ(timer.deadline_ns(), kStart + 401 * kPeriod);  // the phase is kept
  clock.now += 1'000;
  timer.wait();
  EXPECT_EQ(timer.deadline_ns(), kStart + 402 * kPeriod);
  EXPECT_EQ(timer.overruns(), 400u);
}

TEST(DeadlineTimer, ALateWakeUpAloneIsNoOverrun) {
  MockClock clock;
  clock.latenesses = {kPeriod - 1};
  DeadlineTimer timer(kPeriod, kStart, clock);
  EXPECT_EQ(timer.wait(), kPeriod - 1);
  EXPECT_EQ(timer.wait(), 0);
  EXPECT_EQ(timer.overruns(), 0u);
}

TEST(DeadlineTimer, AWakeUpLaterThanAPeriodMissesTheDeadlineSleptThrough) {
  MockClock clock;
  clock.latenesses = {kPeriod + 700};
  DeadlineTimer timer(kPeriod, kStart, clock);
  EXPECT_EQ(timer.wait(), kPeriod + 700);
  EXPECT_EQ(timer.overruns(), 0u);  // late for the first deadline only
  EXPECT_EQ(timer.wait(), 0);
  EXPECT_EQ(timer.overruns(), 1u);
  EXPECT_EQ(timer.deadline_ns(), kStart + 2 * kPeriod);
}

TEST(DeadlineTimer, ADeadlineReachedExactlyIsNotMissed) {
  MockClock clock;
  DeadlineTimer timer(kPeriod, kStart, clock);
  timer.wait();
  clock.now += kPeriod;
  EXPECT_EQ(timer.wait(), 0);
  clock.now += 3 * kPeriod;
  EXPECT_EQ(timer.wait(), 0);
  EXPECT_EQ(timer.deadline_ns(), kStart + 4 * kPeriod);
  EXPECT_EQ(timer.overruns(), 2u);
  EXPECT_EQ(clock.sleeps.size(), 1u);
}

TEST(DeadlineTimer, ASleepCutShortBySignalsIsTakenUpAgain) {
  MockClock clock;
  clock.latenesses = {-3'000'000, -1'000'000, 50};
  DeadlineTimer timer(kPeriod, kStart, clock);
  EXPECT_EQ(timer.wait(), 50);
  EXPECT_EQ(clock.sleeps.size(), 3u);
}

TEST(MonotonicClock, NeverGoesBackAndReturnsAtOnceFromADeadlineInThePast) {
  const std::int64_t before = monotonic_ns();
  monotonic_clock().sleep_until_ns(before - 1'000'000'000'000'000);
  monotonic_clock().sleep_until_ns(before);
  EXPECT_GE(monotonic_clock().now_ns(), before);
  EXPECT_GT(before, 0);
}

}  // namespace
}  // namespace brachy
