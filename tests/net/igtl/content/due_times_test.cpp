#include "net/igtl/content/due_times.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace brachy::net::igtl {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kTick = 5 * kMs;

TEST(DueTimes, HaveTheExactMeanOfAPeriodThatIsNoMultipleOfTheTicks) {
  DueTimes due(33 * kMs, kTick);
  int passed = 0;
  for (std::int64_t now = kMs; now < kMs + 33'000 * kMs; now += kTick) {
    if (!due.pass(now)) continue;
    // The nearest tick.
    EXPECT_LE(std::abs(now - (kMs + 33 * kMs * passed)), kTick / 2) << passed;
    ++passed;
  }
  EXPECT_EQ(passed, 1000);
  EXPECT_EQ(due.missed(), 0u);
}

TEST(DueTimes, DoNotDriftWhereTicksAreLateOrLost) {
  DueTimes due(33 * kMs, kTick);
  int passed = 0;
  std::uint32_t random = 1;
  for (std::int64_t now = kMs; now < kMs + 330'000 * kMs;) {
    passed += due.pass(now);
    random = random * 1664525 + 1013904223;
    now += kTick + (random >> 16) % 25 * kMs;  // 5 to 29 ms
  }
  EXPECT_NEAR(passed, 10'000, 1);
  EXPECT_EQ(due.missed(), 0u);
}

TEST(DueTimes, SendLateWhatIsAPeriodLateAndCountWhatIsLater) {
  DueTimes due(10 * kMs, kTick);
  EXPECT_TRUE(due.pass(0));
  EXPECT_FALSE(due.pass(5 * kMs));
  EXPECT_TRUE(due.pass(20 * kMs)) << "due at 10";
  EXPECT_TRUE(due.pass(25 * kMs)) << "due at 20";
  EXPECT_EQ(due.missed(), 0u);
  EXPECT_TRUE(due.pass(61 * kMs)) << "due at 60; 30, 40 and 50 are left out";
  EXPECT_EQ(due.missed(), 3u) << "50 is 11 ms late";
}

TEST(DueTimes, OfAShortPeriodAreEachTick) {
  for (const std::int64_t period : {std::int64_t{0}, kMs, kTick}) {
    DueTimes due(period, kTick);
    for (int i = 0; i < 100; ++i) EXPECT_TRUE(due.pass(i * kTick + i % 3 * kMs));
    EXPECT_EQ(due.missed(), 0u);
  }
}

TEST(DueTimes, BeginAgainWhereTheClockIsSetBack) {
  DueTimes due(100 * kMs, kTick);
  EXPECT_TRUE(due.pass(50'000 * kMs));
  EXPECT_TRUE(due.pass(5 * kMs));
  EXPECT_FALSE(due.pass(50 * kMs));
  EXPECT_TRUE(due.pass(105 * kMs));
}

}  // namespace
}  // namespace brachy::net::igtl
