#include <gtest/gtest.h>

#include "net/base/rate_limit.h"
#include "net/session/device_lease.h"
#include "net/session/pose_counts.h"
#include "net/session/round_trip.h"

namespace brachy::net::test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(RateLimit, PassesABurstThenTheRate) {
  RateLimit limit(10, 3);
  std::int64_t now = 5 * kSecond;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(limit.pass(now));
  EXPECT_FALSE(limit.pass(now));
  EXPECT_TRUE(limit.pass(now + kSecond / 10));
  EXPECT_FALSE(limit.pass(now + kSecond / 10));
  now += 100 * kSecond;  // a long pause fills no more than one burst
  int passed = 0;
  for (int i = 0; i < 10; ++i) passed += limit.pass(now);
  EXPECT_EQ(passed, 3);
}

TEST(RateLimits, ThoseOfOneNameShareABucketAndOthersDoNot) {
  RateLimits limits;
  EXPECT_TRUE(limits.pass({"ARM", 1, 1}, kSecond));
  EXPECT_FALSE(limits.pass({"ARM", 1, 1}, kSecond));
  EXPECT_TRUE(limits.pass({"DROP", 1, 1}, kSecond));
  EXPECT_TRUE(limits.pass({"ARM", 1, 1}, 2 * kSecond));
}

TEST(DeviceLease, OnlyTheHolderReleasesIt) {
  DeviceLease lease;
  EXPECT_TRUE(lease.take({7, "touch", "127.0.0.1:5", 1}));
  EXPECT_FALSE(lease.take({8, "falcon", "127.0.0.1:6", 2}));
  lease.release(8);
  EXPECT_EQ(lease.holder(), "touch (127.0.0.1:5)");
  lease.release(7);
  EXPECT_EQ(lease.holder(), "");
  EXPECT_TRUE(lease.take({0, "scripted", "", 3}));
  EXPECT_EQ(lease.holder(), "scripted");
}

TEST(RoundTrip, IsTheMedianOfTheLastAnswers) {
  RoundTrip trip;
  EXPECT_FALSE(trip.median_ns());
  std::uint64_t nonce = 0;
  const auto add = [&](std::int64_t ns) {
    trip.on_ping(++nonce, kSecond);
    EXPECT_TRUE(trip.waiting_since_ns());
    trip.on_answer(nonce, kSecond + ns);
    EXPECT_FALSE(trip.waiting_since_ns());
  };
  add(100);
  EXPECT_EQ(trip.median_ns(), 100);
  for (const std::int64_t ns : {300, 200, 5'000'000, 400}) add(ns);
  EXPECT_EQ(trip.median_ns(), 300);
  for (std::size_t i = 0; i < RoundTrip::kWindow; ++i) add(50);
  EXPECT_EQ(trip.median_ns(), 50);
}

TEST(RoundTrip, OnlyTheFirstAnswerToTheNewestQuestionCounts) {
  RoundTrip trip;
  trip.on_ping(1, 1000);
  trip.on_answer(2, 1001);
  EXPECT_FALSE(trip.median_ns());
  trip.on_ping(2, 2000);
  trip.on_answer(1, 2001);
  EXPECT_FALSE(trip.median_ns());
  trip.on_answer(2, 2500);
  trip.on_answer(2, 2501);
  trip.on_answer(2, 2502);
  EXPECT_EQ(trip.median_ns(), 500);
}

TEST(PoseCounts, AddToWhatTheDaemonCountedAndStayFew) {
  PoseCounts counts;
  counts.accept();
  for (std::uint16_t code = 1; code <= 1000; ++code) counts.refuse(code, "why");
  counts.refuse(2, "why not");
  StateMessage state;
  state.poses_accepted = 10;
  state.refusals = {{2, 5, "scripted"}};
  counts.add_to(state);
  EXPECT_EQ(state.poses_accepted, 11u);
  EXPECT_EQ(state.refusals[0].count, 7u);
  EXPECT_EQ(state.refusals[0].text, "why not");
  EXPECT_LE(state.refusals.size(), 34u);
  std::uint64_t total = 0;
  for (const PoseRefusals& refusals : state.refusals) total += refusals.count;
  EXPECT_EQ(total, 5u + 1001u);
}

}  // namespace
}  // namespace brachy::net::test
