#include <gtest/gtest.h>

#include "net/base/retry.h"
#include "net/broker/arrival_offset.h"

namespace brachy::net::test {
namespace {

constexpr std::int64_t kS = 1'000'000'000;

TEST(ConnectRetry, WaitsTwiceAsLongEachTimeAndFromTheBeginningOnceItWasConnected) {
  ConnectRetry retry;
  EXPECT_TRUE(retry.is_due(0));
  std::int64_t now = 0;
  for (const std::int64_t wait : {kS / 2, kS, 2 * kS, 4 * kS, 8 * kS, 8 * kS}) {
    retry.failed(now);
    EXPECT_FALSE(retry.is_due(now + wait - 1));
    now += wait;
    EXPECT_TRUE(retry.is_due(now));
  }
  retry.connected();
  retry.failed(now);
  EXPECT_TRUE(retry.is_due(now + kS / 2));
}

TEST(ArrivalOffset, IsTheQuickestMessagesAndForgetsAfterAMinute) {
  ArrivalOffset offset;
  const std::int64_t start = 100 * kS;
  for (const std::int64_t delay : {5, 3, 9}) offset.add(1000, start + 1000 + delay);
  EXPECT_EQ(offset.offset_ns(), start + 3);
  // The sender's clock runs slower: a nanosecond more a second.
  for (std::int64_t s = 1; s <= 90; ++s) offset.add(1000 + s * (kS - 1), start + 1010 + s * kS);
  EXPECT_GE(offset.offset_ns(), start + 10 + 30);
  EXPECT_LE(offset.offset_ns(), start + 10 + 90);
}

}  // namespace
}  // namespace brachy::net::test
