#include "haptics/force/force_gate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/haptics/milliseconds.h"

namespace brachy {
namespace {

const Vec3 kPush(0, 0.6, -0.8);

/// A gate with a device that sends a pose every millisecond; time advances across calls.
struct Session {
  ForceGate gate;
  std::int64_t now = 0;
  Vec3 force = Vec3::Zero();
  double greatest_jump = 0;

  void run(int ms, bool sends = true) {
    for (int i = 0; i < ms; ++i) {
      now += kMs;
      if (sends) gate.pose_accepted(now);
      const Vec3 next = gate.pass(kPush, now);
      greatest_jump = std::max(greatest_jump, (next - force).norm());
      force = next;
    }
  }
  std::vector<Intervention> announcements() {
    std::vector<Intervention> all;
    for (Intervention i; gate.next_announcement(i);) all.push_back(i);
    return all;
  }
};

TEST(ForceGate, ConnectingInsideFeelsNothingAtFirstAndAllAfterHalfASecond) {
  Session s;
  s.gate.connect(3.3);
  s.run(1000, false);  // connected, but no pose yet: the half second has not begun
  EXPECT_EQ(s.force, Vec3(Vec3::Zero()));
  s.run(1);
  EXPECT_EQ(s.force, Vec3(Vec3::Zero()));
  s.run(250);
  EXPECT_NEAR(s.force.norm(), 0.5, 1e-9);
  s.run(250);
  EXPECT_NEAR((s.force - kPush).norm(), 0, 1e-12);
  EXPECT_LT(s.greatest_jump, 0.0021);
  EXPECT_TRUE(s.announcements().empty());
}

TEST(ForceGate, FiftyMillisecondsWithoutAPoseTakeTheForceAwayUntilArmed) {
  Session s;
  s.gate.connect(3.3);
  s.run(600);
  s.run(50, false);
  EXPECT_NEAR(s.force.norm(), 1, 1e-12);
  s.greatest_jump = 0;
  s.run(1, false);
  EXPECT_NEAR(s.force.norm(), 0.5, 1e-12);
  s.run(1, false);
  EXPECT_EQ(s.force, Vec3(Vec3::Zero()));
  EXPECT_LE(s.greatest_jump, 0.5 + 1e-12);
  EXPECT_TRUE(s.gate.latched());
  EXPECT_EQ(s.announcements(), std::vector{Intervention::kStale});
  s.run(1000);  // poses alone do not restore it
  EXPECT_EQ(s.force, Vec3(Vec3::Zero()));
  s.gate.arm();
  s.run(1);
  EXPECT_EQ(s.force, Vec3(Vec3::Zero()));
  s.run(500);
  EXPECT_NEAR(s.force.norm(), 1, 1e-12);
  EXPECT_EQ(s.gate.count(Intervention::kStale), 1u);
}

TEST(ForceGate, APoseThatIsNotFiniteLatches) {
  Session s;
  s.gate.connect(3.3);
  s.run(600);
  s.gate.pose_not_finite();
  s.gate.pose_not_finite();
  s.run(2);
  EXPECT_EQ(s.force, Vec3(Vec3::Zero()));
  EXPECT_EQ(s.gate.count(Intervention::kNotFinite), 2u);
  EXPECT_EQ(s.announcements().size(), 1u) << "one fault is told once";
  EXPECT_EQ(s.gate.gain(s.now), 0);
}

TEST(ForceGate, ADeviceLostInContactLeavesTheNextOneWithoutForceUntilArmed) {
  Session s;
  s.gate.connect(3.3);
  s.run(600);
  s.gate.disconnect(true);
  s.run(2, false);
  EXPECT_EQ(s.force, Vec3(Vec3::Zero()));
  s.gate.connect(3.3);
  s.run(1000);
  EXPECT_EQ(s.force, Vec3(Vec3::Zero()));
  EXPECT_EQ(s.announcements(), std::vector{Intervention::kDisconnected});
  s.gate.arm();
  s.run(501);
  EXPECT_NEAR(s.force.norm(), 1, 1e-12);
}

TEST(ForceGate, LeavingOutOfContactDoesNotLatch) {
  Session s;
  s.gate.connect(3.3);
  s.run(10);
  s.gate.disconnect(false);
  s.run(10, false);
  s.gate.connect(3.3);
  s.run(501);
  EXPECT_NEAR(s.force.norm(), 1, 1e-12);
  EXPECT_TRUE(s.announcements().empty());
}

TEST(ForceGate, LimitsAreToldOnceAConnectionAndCountedEachTime) {
  Session s;
  s.gate.connect(0.8);
  for (int i = 0; i < 3; ++i) {
    s.run(600);
    s.gate.pass(Vec3::Zero(), s.now += kMs);
    s.gate.pass(Vec3::Zero(), s.now += kMs);
  }
  EXPECT_EQ(s.gate.count(Intervention::kForceLimited), 3u);
  s.gate.note_stiffness(true);
  s.gate.note_stiffness(true);
  EXPECT_EQ(s.gate.count(Intervention::kStiffnessLimited), 1u);
  const std::vector<Intervention> told = s.announcements();
  EXPECT_EQ(std::ranges::count(told, Intervention::kForceLimited), 1);
  EXPECT_EQ(std::ranges::count(told, Intervention::kStiffnessLimited), 1);
}

TEST(ForceGate, AForceThatIsNotFiniteIsNone) {
  Session s;
  s.gate.connect(3.3);
  s.run(600);
  Vec3 force = s.gate.pass(Vec3(NAN, 0, 0), s.now += kMs);
  EXPECT_NEAR(force.norm(), 0.5, 1e-12);
  force = s.gate.pass(Vec3(0, std::numeric_limits<double>::infinity(), 0), s.now += kMs);
  EXPECT_EQ(force, Vec3(Vec3::Zero()));
}

}  // namespace
}  // namespace brachy
