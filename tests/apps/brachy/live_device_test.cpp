// The device of `brachy replay --connect --device-dynamics`, in a time that the test sets.
#include "apps/brachy/replay/live_device.h"

#include <gtest/gtest.h>

namespace brachy::test {
namespace {

constexpr std::int64_t kMsNs = 1'000'000;

/// A hand that goes 1 mm along z in 10 ms and stays.
RigidTransform pushed(double t_s) {
  return {Mat3::Identity(), Vec3(0, 0, std::min(100 * t_s, 1.0))};
}

/// Tissue from z = 0 on that sticks, 1 N/mm.
LocalContactModel tissue() {
  LocalContactModel m;
  m.in_contact = true;
  m.axial_stiffness_n_per_mm = 1;
  m.axial_min_n = -5;
  m.axial_max_n = 5;
  return m;
}

TEST(LiveDevice, TheHandFeelsTheModelsUntilTheyEnd) {
  LiveDevice device({}, pushed, 0);
  std::optional<LiveDevice::Pose> last;
  for (int ms = 0; ms <= 100; ++ms) {
    device.take(tissue(), ms * kMsNs, ms * kMsNs);
    last = device.advance(ms * kMsNs);
  }
  ASSERT_TRUE(last);
  EXPECT_LT(last->X_WN.p.z(), 0.5);  // tissue of 1 N/mm holds it against a grip of 0.3 N/mm
  EXPECT_GT(device.report().peak_force_n(), 0.2);
  last = device.advance(1000 * kMsNs);  // nothing has come since
  ASSERT_TRUE(last);
  EXPECT_GT(last->X_WN.p.z(), 0.95);
}

TEST(LiveDevice, ALateWakeUpChangesNoMotion) {
  LiveDevice even({}, pushed, 0), late({}, pushed, 0);
  even.take(tissue(), 0, 0);
  late.take(tissue(), 0, 0);
  std::optional<LiveDevice::Pose> a;
  for (int ms = 0; ms <= 40; ++ms) a = even.advance(ms * kMsNs);
  const auto b = late.advance(40 * kMsNs);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->stamp_ns, b->stamp_ns);
  EXPECT_EQ(a->X_WN.p, b->X_WN.p);
  EXPECT_EQ(even.report().peak_force_n(), late.report().peak_force_n());
}

TEST(LiveDevice, ASimpleClientRendersWhatTheDaemonSends) {
  LiveDevice device({.simple_client = true}, pushed, 0);
  for (int ms = 0; ms <= 100; ++ms) {
    net::ForceMessage force;
    force.forces.force_n = {0, 0, -0.4};
    force.valid_ms = 30;
    device.take(force, ms * kMsNs);
    device.advance(ms * kMsNs);
  }
  EXPECT_NEAR(device.report().peak_force_n(), 0.4, 1e-9);
}

}  // namespace
}  // namespace brachy::test
