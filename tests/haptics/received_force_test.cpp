#include "haptics/force/received_force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/haptics/milliseconds.h"

namespace brachy {
namespace {

/// A device's cycle of 1 ms.
struct ReceivedForceTest : ::testing::Test {
  void cycle() {
    now_ns += kMs;
    const Vec3 next = received.evaluate(now_ns);
    ASSERT_TRUE(next.allFinite());
    ASSERT_LE(next.norm(), kDefaultMaxForceN + 1e-9);
    ASSERT_LE((next - force_n).norm(), kMaxSlewNPerMs + 1e-9) << "at " << now_ns / kMs << " ms";
    force_n = next;
  }
  void receive(int milliseconds, bool is_latched = false) {
    for (int i = 0; i < milliseconds; ++i) {
      received.take(sent_n, 0, is_latched, now_ns);
      cycle();
    }
  }
  void hear_nothing(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) cycle();
  }

  ReceivedForce received;
  std::int64_t now_ns = 1000 * kMs;
  Vec3 sent_n{0, 0, -3.3}, force_n = Vec3::Zero();
};

TEST_F(ReceivedForceTest, StandsForItsTimeToLiveThenGoesToZeroAndStaysThere) {
  receive(20);
  EXPECT_EQ(force_n, sent_n);
  hear_nothing(49);
  EXPECT_EQ(force_n, sent_n);
  EXPECT_FALSE(received.is_latched());
  hear_nothing(9);  // 3.3 N at 0.5 N/ms
  EXPECT_EQ(force_n, Vec3(Vec3::Zero()));
  EXPECT_TRUE(received.is_latched());
  receive(1000);  // the daemon goes on as if nothing had happened
  EXPECT_EQ(force_n, Vec3(Vec3::Zero()));
}

TEST_F(ReceivedForceTest, ComesBackOverHalfASecondAfterArm) {
  receive(20);
  hear_nothing(100);
  received.arm();
  receive(250);
  EXPECT_NEAR(force_n.norm(), 3.3 / 2, 0.05);
  receive(260);
  EXPECT_EQ(force_n, sent_n);
}

TEST_F(ReceivedForceTest, ALatchOfTheServersThatWasArmedEndsItsOwn) {
  receive(20);
  hear_nothing(100);
  receive(30, true);
  EXPECT_TRUE(received.is_latched());
  receive(1);
  EXPECT_FALSE(received.is_latched());
  receive(600);
  EXPECT_EQ(force_n, sent_n);
}

TEST_F(ReceivedForceTest, ALostConnectionEndsTheForceAtOnce) {
  receive(20);
  received.lose();
  hear_nothing(7);
  EXPECT_EQ(force_n, Vec3(Vec3::Zero()));
  EXPECT_TRUE(received.is_latched());
}

TEST_F(ReceivedForceTest, AValidityOutOfRangeIsBounded) {
  received.take(sent_n, 4'000'000'000u, false, now_ns);
  hear_nothing(5020);
  EXPECT_EQ(force_n, Vec3(Vec3::Zero()));
  EXPECT_TRUE(received.is_latched());
}

TEST_F(ReceivedForceTest, ANumberThatIsNotFiniteIsNotTakenAndDoesNotProlongTheLast) {
  receive(20);
  for (int i = 0; i < 60; ++i) {
    EXPECT_FALSE(received.take(Vec3(0, 0, NAN), 0, false, now_ns));
    EXPECT_FALSE(received.take(Vec3(INFINITY, 0, 0), 0, false, now_ns));
    cycle();
  }
  EXPECT_EQ(force_n, Vec3(Vec3::Zero()));
}

TEST_F(ReceivedForceTest, HugeForcesAndExtremeStampsStayWithinTheLimits) {
  sent_n = Vec3::Constant(1e100);
  receive(50);
  EXPECT_NEAR(force_n.norm(), kDefaultMaxForceN, 1e-9);
  sent_n = Vec3::Constant(std::numeric_limits<double>::max());  // its norm is not finite
  receive(50);
  EXPECT_EQ(force_n, Vec3(Vec3::Zero()));
  for (const std::int64_t at : {INT64_MIN, INT64_MAX, std::int64_t{0}, INT64_MIN}) {
    received.take(sent_n, 1, false, at);
    EXPECT_LE((received.evaluate(at) - force_n).norm(), kMaxSlewNPerMs + 1e-9);
    force_n = received.evaluate(at);
  }
}

}  // namespace
}  // namespace brachy
