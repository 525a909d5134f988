#include "net/base/timeout_checks.h"

#include <gtest/gtest.h>

namespace brachy::net {
namespace {

constexpr std::int64_t kMs = 1'000'000, kStart = 1'000'000 * kMs, kPeriod = 20 * kMs;

TEST(TimeoutChecks, LookAheadSoThatNoTimeoutIsExceeded) {
  TimeoutChecks checks;
  for (int i = 0; i < 10; ++i) {
    const std::int64_t now = kStart + i * kPeriod;
    EXPECT_EQ(checks.as_of(now), now + 2 * kPeriod);
  }
}

TEST(TimeoutChecks, LeaveOutOneThatComesFarTooLateButNeverTwoInTurn) {
  TimeoutChecks checks;
  checks.as_of(kStart);
  EXPECT_TRUE(checks.as_of(kStart + 250 * kMs));
  EXPECT_FALSE(checks.as_of(kStart + 6000 * kMs));
  EXPECT_TRUE(checks.as_of(kStart + 6020 * kMs));
  // Timeouts work even on a machine on which every check is late.
  EXPECT_FALSE(checks.as_of(kStart + 7000 * kMs));
  EXPECT_TRUE(checks.as_of(kStart + 8000 * kMs));
  EXPECT_FALSE(checks.as_of(kStart + 9000 * kMs));
}

}  // namespace
}  // namespace brachy::net
