#include "haptics/force/force_limiter.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

#include "tests/haptics/milliseconds.h"

namespace brachy {
namespace {

TEST(ForceLimiter, NeverFasterThanHalfANewtonAMillisecond) {
  ForceLimiter limiter;
  std::int64_t now = 77 * kMs;
  Vec3 last = limiter.step(Vec3(0, 0, 3), now);
  EXPECT_EQ(last, Vec3(Vec3::Zero())) << "no time is known at the first step";
  for (int i = 0; i < 40; ++i) {
    now += kMs / 4;
    const Vec3 force = limiter.step(i < 20 ? Vec3(0, 0, 3) : Vec3(1, -2, 0), now);
    EXPECT_LE((force - last).norm(), 0.125 + 1e-12) << i;
    last = force;
  }
  EXPECT_NEAR((last - Vec3(1, -2, 0)).norm(), std::max(0.0, (Vec3(1, -2, 0) - Vec3(0, 0, 2.5)).norm() - 2.5),
              1e-9);
}

TEST(ForceLimiter, ReachesWhatIsAskedForAndSaysWhileItIsOnItsWay) {
  ForceLimiter limiter;
  limiter.step(Vec3(0, 0, 1), 0);
  EXPECT_TRUE(limiter.slewed());
  EXPECT_EQ(limiter.step(Vec3(0, 0, 1), kMs), Vec3(0, 0, 0.5));
  EXPECT_EQ(limiter.step(Vec3(0, 0, 1), 2 * kMs), Vec3(0, 0, 1));
  EXPECT_FALSE(limiter.slewed());
}

TEST(ForceLimiter, ALongPauseIsNoLicenceForAJump) {
  ForceLimiter limiter;
  limiter.step(Vec3::Zero(), 0);
  EXPECT_NEAR(limiter.step(Vec3(0, 0, 3), 1000 * kMs).norm(), 0.5, 1e-12);
  EXPECT_NEAR(limiter.step(Vec3(0, 0, 3), std::numeric_limits<std::int64_t>::max()).norm(), 1, 1e-12);
}

TEST(ForceLimiter, AClockThatGoesBackGivesNoTime) {
  ForceLimiter limiter;
  limiter.step(Vec3(0, 0, 3), 10 * kMs);
  limiter.step(Vec3(0, 0, 3), 11 * kMs);
  EXPECT_NEAR(limiter.step(Vec3(0, 0, 3), std::numeric_limits<std::int64_t>::min()).norm(), 0.5, 1e-12);
}

TEST(ForceLimiter, ScalesTheVectorToTheLimit) {
  ForceLimiter limiter(2);
  Vec3 force = Vec3::Zero();
  for (std::int64_t t = 0; t <= 10 * kMs; t += kMs) force = limiter.step(Vec3(3, 0, -4), t);
  EXPECT_TRUE(limiter.clamped());
  EXPECT_NEAR((force - Vec3(1.2, 0, -1.6)).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace brachy
