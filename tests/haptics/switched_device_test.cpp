#include "haptics/devices/switched_device.h"

#include <gtest/gtest.h>

namespace brachy {
namespace {

constexpr std::int64_t kDeviceTick = 5'000'000, kSwitchStart = 77 * kDeviceTick;

RigidTransform switched_tip_at(double z_mm) {
  return {Mat3::Identity(), Vec3(0, 0, z_mm)};
}

NeedlePose pose_of(double z_mm, std::uint64_t sequence) {
  NeedlePose pose;
  pose.X_WN = switched_tip_at(z_mm);
  pose.sequence = sequence;
  pose.stamp_ns = pose.received_ns = kSwitchStart + static_cast<std::int64_t>(sequence) * kDeviceTick;
  return pose;
}

/// 1 s along z at 10 mm/s, with the button held from 0.5 s on.
Trajectory pressed_ten_mm() {
  return Trajectory(
      {{0, switched_tip_at(0)}, {0.5, switched_tip_at(5), true}, {1, switched_tip_at(10), true}});
}

struct SwitchedDeviceTest : ::testing::Test {
  bool update() { return device.update(now += kDeviceTick, pose); }

  SwitchedDevice device{{}, ScriptedDevice(pressed_ten_mm())};
  NeedlePose pose;
  std::int64_t now = kSwitchStart;
};

TEST_F(SwitchedDeviceTest, IsTheNetworksUntilItPlaysAndAgainAfterwards) {
  device.network().attach();
  device.network().submit(pose_of(-30, 1));
  ASSERT_TRUE(update());
  EXPECT_EQ(pose.X_WN, switched_tip_at(-30));
  device.network().detach();

  device.play(false);
  ASSERT_TRUE(update());
  EXPECT_EQ(pose.X_WN, switched_tip_at(0));
  ASSERT_TRUE(update());
  EXPECT_NEAR(pose.X_WN.p.z(), 0.05, 1e-12);

  device.stop();
  EXPECT_FALSE(update());
  EXPECT_FALSE(pose.present);
  device.network().attach();
  device.network().submit(pose_of(-20, 2));
  ASSERT_TRUE(update());
  EXPECT_TRUE(pose.present);
  EXPECT_EQ(pose.X_WN, switched_tip_at(-20));
}

TEST_F(SwitchedDeviceTest, PlaysFromTheBeginningEachTimeItIsToldTo) {
  device.play(false);
  for (int i = 0; i < 50; ++i) update();
  EXPECT_NEAR(pose.X_WN.p.z(), 49 * 0.05, 1e-9);
  device.play(true);
  ASSERT_TRUE(update());
  EXPECT_EQ(pose.X_WN, switched_tip_at(0));
  for (int i = 0; i < 250; ++i) update();  // looping: 1 s is 200 ticks
  EXPECT_NEAR(pose.X_WN.p.z(), 50 * 0.05, 1e-9);
}

TEST_F(SwitchedDeviceTest, PosesFromTheNetworkAreRefusedWhileItPlays) {
  device.play(false);
  update();
  device.network().submit(pose_of(-30, 9));  // nobody sends: the server lends the lease to no one meanwhile
  ASSERT_TRUE(update());
  EXPECT_NEAR(pose.X_WN.p.z(), 0.05, 1e-12);
}

TEST_F(SwitchedDeviceTest, APressCountsBesideTheScriptsOwnButton) {
  device.play(false);
  ASSERT_TRUE(update());
  EXPECT_FALSE(pose.button);
  device.network().press(true);
  update();
  EXPECT_TRUE(pose.button);
  device.network().press(false);
  update();
  EXPECT_FALSE(pose.button);
  for (int i = 0; i < 120; ++i) update();
  EXPECT_TRUE(pose.button);  // the script's
  device.network().press(true);
  device.network().press(false);
  for (int i = 0; i < 3; ++i) update();
  EXPECT_TRUE(pose.button);
}

TEST_F(SwitchedDeviceTest, AButtonHeldWhenTheScriptStopsIsUpAfterwards) {
  device.play(false);
  device.network().press(true);
  update();
  EXPECT_TRUE(pose.button);
  device.stop();
  update();
  EXPECT_FALSE(pose.button);
  device.network().attach();
  for (std::uint64_t i = 1; i < 4; ++i) {
    device.network().submit(pose_of(-30, i));
    update();
  }
  EXPECT_FALSE(pose.button);
}

}  // namespace
}  // namespace brachy
