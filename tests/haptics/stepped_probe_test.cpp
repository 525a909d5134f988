#include "haptics/devices/stepped_probe.h"

#include <gtest/gtest.h>

#include "haptics/devices/switched_device.h"

namespace brachy {
namespace {

constexpr std::int64_t kProbeTick = 5'000'000;

RigidTransform rest() {
  RigidTransform X;
  X.p = Vec3(1, -40, 20);
  return X;
}

struct SteppedProbeTest : ::testing::Test {
  SteppedProbeTest() { device.add_stepper(rest()); }
  bool update() { return device.update(now += kProbeTick, pose); }
  void updates(int count) {
    for (int i = 0; i < count; ++i) update();
  }

  SwitchedDevice device{{}, std::nullopt};
  NeedlePose pose;
  std::int64_t now = 77 * kProbeTick;
};

TEST_F(SteppedProbeTest, IsNotThereUntilItIsSentSomewhere) {
  EXPECT_FALSE(update());
  EXPECT_FALSE(pose.present);
}

TEST_F(SteppedProbeTest, BeginsAtRestAndMovesAtItsSpeedToWhereItIsSent) {
  device.stepper()->move_to({5, 0});
  ASSERT_TRUE(update());
  EXPECT_TRUE(pose.present);
  EXPECT_EQ(pose.X_WN, rest());
  const std::uint64_t first = pose.sequence;
  updates(10);  // 50 ms at 20 mm/s
  EXPECT_NEAR(pose.X_WN.p.z(), 20 + 1, 1e-9);
  EXPECT_EQ(pose.sequence, first + 10);
  updates(60);
  EXPECT_NEAR(pose.X_WN.p.z(), 20 + 5, 1e-9);
  EXPECT_FALSE(update()) << "it is there";
}

TEST_F(SteppedProbeTest, TurnsAboutItsOwnAxis) {
  device.stepper()->move_to({0, 90});
  updates(1 + 400);  // 2 s at 45 degrees a second
  EXPECT_TRUE(pose.X_WN.p.isApprox(rest().p));
  EXPECT_TRUE(pose.X_WN.R.col(0).isApprox(Vec3::UnitY(), 1e-9)) << pose.X_WN.R;
  EXPECT_TRUE(pose.X_WN.R.col(2).isApprox(Vec3::UnitZ(), 1e-9));
}

TEST_F(SteppedProbeTest, ADeviceThatTakesItMovesItFromThere) {
  device.stepper()->move_to({5, 0});
  updates(5);
  device.stepper()->release();
  EXPECT_FALSE(device.stepper()->is_on());
  device.network().attach();
  NeedlePose sent;
  sent.X_WN = rest();
  sent.X_WN.p.y() += 3;
  sent.sequence = 1;
  sent.stamp_ns = sent.received_ns = now;
  device.network().submit(sent);
  ASSERT_TRUE(update());
  EXPECT_EQ(pose.X_WN, sent.X_WN);
}

TEST_F(SteppedProbeTest, AProbeThatADeviceLeftElsewhereIsTakenOutBeforeItIsPutInAtRest) {
  pose.present = true;  // where the device left it
  pose.X_WN.p = Vec3(9, 9, 9);
  device.stepper()->move_to({0, 0});
  ASSERT_TRUE(update());
  EXPECT_FALSE(pose.present);
  ASSERT_TRUE(update());
  EXPECT_TRUE(pose.present);
  EXPECT_EQ(pose.X_WN, rest());
}

TEST_F(SteppedProbeTest, AfterMissedTicksItDoesNotJump) {
  device.stepper()->move_to({50, 0});
  updates(2);
  now += 3'000'000'000;
  update();
  EXPECT_LE(pose.X_WN.p.z(), 20 + 0.1 + 2 + 1e-9);
}

}  // namespace
}  // namespace brachy
