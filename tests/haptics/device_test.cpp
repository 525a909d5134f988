#include <gtest/gtest.h>

#include <cmath>
#include <latch>
#include <thread>

#include "haptics/devices/network_device.h"
#include "haptics/devices/scripted_device.h"

namespace brachy {
namespace {

constexpr std::int64_t kScriptTick = 5'000'000;
constexpr std::int64_t kStart = 123 * kScriptTick;

RigidTransform tip_at(double z_mm) {
  return {Mat3::Identity(), Vec3(0, 0, z_mm)};
}

/// 1 s along z at 10 mm/s, its first sample not at time 0.
Trajectory ten_mm() {
  return Trajectory({{0.25, tip_at(0)}, {0.75, tip_at(5)}, {1.25, tip_at(10)}});
}

TEST(ScriptedDevice, StartsWithTheFirstSampleAtTheFirstUpdate) {
  ScriptedDevice device(ten_mm());
  NeedlePose pose;
  ASSERT_TRUE(device.update(kStart, pose));
  EXPECT_TRUE(pose.present);
  EXPECT_EQ(pose.X_WN, tip_at(0));
  EXPECT_EQ(pose.sequence, 1u);
  EXPECT_EQ(pose.stamp_ns, kStart);
  EXPECT_EQ(pose.received_ns, kStart);
}

TEST(ScriptedDevice, PlaysInRealTimeAlsoOverMissedTicks) {
  ScriptedDevice device(ten_mm());
  NeedlePose pose;
  device.update(kStart, pose);
  for (std::int64_t tick : {1, 2, 3, 50, 51, 100, 150, 199}) {
    ASSERT_TRUE(device.update(kStart + tick * kScriptTick, pose));
    EXPECT_NEAR(pose.X_WN.p.z(), 0.05 * static_cast<double>(tick), 1e-9);
    EXPECT_EQ(pose.stamp_ns, kStart + tick * kScriptTick);
  }
  EXPECT_EQ(pose.sequence, 9u);
  EXPECT_FALSE(device.finished());
}

TEST(ScriptedDevice, HoldsTheLastPoseAfterTheEnd) {
  ScriptedDevice device(ten_mm());
  NeedlePose pose;
  device.update(kStart, pose);
  EXPECT_TRUE(device.update(kStart + 203 * kScriptTick, pose));
  EXPECT_EQ(pose.X_WN, tip_at(10));
  EXPECT_TRUE(device.finished());
  EXPECT_FALSE(device.update(kStart + 204 * kScriptTick, pose));
  EXPECT_EQ(pose.X_WN, tip_at(10));
  EXPECT_TRUE(pose.present);
}

TEST(ScriptedDevice, LoopsWithoutEndAndWithoutDrift) {
  ScriptedDevice device(ten_mm(), true);
  NeedlePose pose;
  for (std::int64_t tick = 0; tick < 2000; ++tick) {
    ASSERT_TRUE(device.update(kStart + tick * kScriptTick, pose));
    ASSERT_NEAR(pose.X_WN.p.z(), 0.05 * static_cast<double>(tick % 200), 1e-9) << tick;
    ASSERT_EQ(pose.sequence, static_cast<std::uint64_t>(tick) + 1);
  }
  EXPECT_FALSE(device.finished());
}

TEST(ScriptedDevice, LoopsOverASinglePose) {
  ScriptedDevice device(Trajectory({{3.0, tip_at(4)}}), true);
  NeedlePose pose;
  for (std::int64_t tick = 0; tick < 3; ++tick) {
    EXPECT_TRUE(device.update(kStart + tick * kScriptTick, pose));
    EXPECT_EQ(pose.X_WN, tip_at(4));
  }
}

NeedlePose device_pose(std::uint64_t n) {
  NeedlePose pose;
  pose.X_WN = {Eigen::AngleAxisd(1e-3 * static_cast<double>(n), Vec3::UnitX()).toRotationMatrix(),
               Vec3::Constant(1e-3 * static_cast<double>(n))};
  pose.sequence = n;
  pose.stamp_ns = static_cast<std::int64_t>(n) * kScriptTick;
  pose.received_ns = pose.stamp_ns + kStart;
  return pose;
}

TEST(NetworkDevice, HasNoPoseUntilADeviceSpeaks) {
  NetworkDevice device;
  NeedlePose pose;
  EXPECT_FALSE(device.update(kStart, pose));
  device.attach();
  EXPECT_FALSE(device.update(kStart, pose));
  EXPECT_FALSE(pose.present);
}

TEST(NetworkDevice, GivesTheNewestAcceptedPoseOnce) {
  NetworkDevice device;
  NeedlePose pose;
  device.attach();
  for (std::uint64_t n : {1, 2, 3}) EXPECT_EQ(device.submit(device_pose(n)), PoseStatus::kAccepted);
  ASSERT_TRUE(device.update(kStart, pose));
  EXPECT_EQ(pose.sequence, 3u);
  EXPECT_EQ(pose.X_WN, device_pose(3).X_WN);
  EXPECT_EQ(pose.stamp_ns, device_pose(3).stamp_ns);
  EXPECT_TRUE(pose.present);
  EXPECT_FALSE(device.update(kStart, pose));
}

TEST(NetworkDevice, ARefusedPoseNeverReachesTheSimulation) {
  NetworkDevice device;
  NeedlePose pose;
  device.attach();
  device.submit(device_pose(1));
  device.update(kStart, pose);
  NeedlePose bad = device_pose(2);
  bad.X_WN.p.x() = std::nan("");
  EXPECT_EQ(device.submit(bad), PoseStatus::kNotFinite);
  EXPECT_FALSE(device.update(kStart, pose));
  EXPECT_EQ(pose.sequence, 1u);
  EXPECT_EQ(device.guard().count(PoseStatus::kNotFinite), 1u);
}

TEST(NetworkDevice, KeepsTheLastGoodPoseWhenTheLeaseEnds) {
  NetworkDevice device;
  NeedlePose pose;
  device.attach();
  device.submit(device_pose(8));
  device.detach();
  EXPECT_FALSE(device.attached());
  EXPECT_EQ(device.submit(device_pose(9)), PoseStatus::kNotAttached);
  EXPECT_EQ(device.guard().count(PoseStatus::kNotAttached), 1u);
  EXPECT_TRUE(device.update(kStart, pose));
  EXPECT_FALSE(device.update(kStart + kScriptTick, pose));
  EXPECT_EQ(pose.sequence, 8u);
}

TEST(NetworkDevice, ANewDeviceStartsItsCountAndClockAnew) {
  NetworkDevice device;
  NeedlePose pose;
  device.attach();
  device.submit(device_pose(1000));
  device.detach();
  device.attach();
  EXPECT_EQ(device.submit(device_pose(1)), PoseStatus::kAccepted);
  EXPECT_TRUE(device.update(kStart, pose));
  EXPECT_EQ(pose.sequence, 1u);
}

TEST(NetworkDevice, HandsWholePosesFromTheIoThreadToTheSimulation) {
  constexpr std::uint64_t kPoses = 50'000;
  NetworkDevice device;
  std::latch start(2);
  std::thread io([&] {
    device.attach();
    start.arrive_and_wait();
    for (std::uint64_t n = 1; n <= kPoses; ++n) device.submit(device_pose(n));
  });
  NeedlePose pose;
  std::uint64_t last = 0, torn = 0, backwards = 0;
  start.arrive_and_wait();
  while (last < kPoses) {
    if (!device.update(kStart, pose)) {
      std::this_thread::yield();
      continue;
    }
    const NeedlePose expected = device_pose(pose.sequence);
    if (pose.X_WN != expected.X_WN || pose.stamp_ns != expected.stamp_ns) ++torn;
    if (pose.sequence <= last) ++backwards;
    last = pose.sequence;
  }
  io.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(backwards, 0u);
  EXPECT_EQ(device.guard().refused(), 0u);
}

TEST(NetworkDevice, ShowsEachChangeOfTheButtonToOneTickAtLeast) {
  NetworkDevice device;
  NeedlePose pose;
  device.press(true);  // nobody is attached
  device.attach();
  device.press(true);
  device.update(kStart, pose);
  EXPECT_FALSE(pose.button);  // there is no needle yet to press for
  NeedlePose sent;
  sent.X_WN = tip_at(0);
  sent.sequence = 1;
  sent.stamp_ns = sent.received_ns = kStart;
  ASSERT_EQ(device.submit(sent), PoseStatus::kAccepted);
  EXPECT_TRUE(device.update(kStart, pose));
  EXPECT_TRUE(pose.button);
  EXPECT_FALSE(device.update(kStart + kScriptTick, pose));
  EXPECT_TRUE(pose.button);
  device.press(true);  // again: no change
  device.press(false);
  device.press(true);
  device.press(false);
  for (const bool shown : {false, true, false, false}) {
    device.update(kStart + 2 * kScriptTick, pose);
    EXPECT_EQ(pose.button, shown);
  }
  device.press(true);
  device.detach();
  for (const bool shown : {true, false, false}) {
    device.update(kStart + 3 * kScriptTick, pose);
    EXPECT_EQ(pose.button, shown);
  }
}

}  // namespace
}  // namespace brachy
