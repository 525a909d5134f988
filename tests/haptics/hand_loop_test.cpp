#include "haptics/devices/hand_loop.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/haptics/milliseconds.h"

namespace brachy {
namespace {

/// A device that is where the test puts it and notes what it is to render.
struct FakeHand final : HandDevice {
  HandDeviceFacts facts() const override { return {"fake", max_force_n}; }
  bool exchange(const Vec3& force, HandReading& reading) override {
    force_n = force;
    reading = {is_known ? p : Vec3(Vec3::Constant(NAN)), R, button};
    return is_there;
  }

  double max_force_n = 9;
  Vec3 p = Vec3::Zero();
  std::optional<Mat3> R;
  bool button = false, is_there = true, is_known = true;
  Vec3 force_n = Vec3::Zero();
};

struct HandLoopTest : ::testing::Test {
  /// Tissue of 1 N/mm that sticks, from the start tip on along world z.
  LocalContactModel tissue() const {
    LocalContactModel model;
    model.tick = 1;
    model.in_contact = true;
    model.reference_tip = model.contact_point = mapping.start_tip_mm;
    model.axial_stiffness_n_per_mm = 1;
    model.axial_min_n = -20;
    model.axial_max_n = 20;
    model.lateral_n = lateral_n;
    return model;
  }
  void run_to(std::int64_t end_ms, HandLoop& loop) {
    for (; now_ms < end_ms; ++now_ms) {
      if (sends_models && now_ms % 5 == 0) loop.take(tissue(), LocalForce::kUnknown, now_ms * kMs);
      cycle = loop.run(now_ms * kMs);
    }
  }

  FakeHand hand;
  HandMapping mapping;
  std::int64_t now_ms = 0;
  Vec3 lateral_n = Vec3::Zero();
  bool sends_models = true;
  std::optional<HandLoop::Cycle> cycle;
};

TEST_F(HandLoopTest, TheFirstReadingIsTheStartAndMovementsAreTurnedAndScaled) {
  mapping.R_WD << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // the device's y is the world's z
  mapping.scale = 2;
  HandLoop loop(hand, mapping);
  hand.p = Vec3(30, -100, 200);
  EXPECT_EQ(loop.run(0)->X_WN->p, mapping.start_tip_mm);
  hand.p += Vec3(1, 5, 0);
  EXPECT_EQ(loop.run(kMs)->X_WN->p, mapping.start_tip_mm + Vec3(2, 0, 10));
}

/// A device by the directions of its frame that its user sees as right and up.
struct Axes {
  const char* device;
  Vec3 right, up;
  Vec3 in() const { return up.cross(right); }
};
const Axes kDevices[] = {{"Haply", Vec3::UnitX(), Vec3::UnitZ()},
                         {"Force Dimension", Vec3::UnitY(), Vec3::UnitZ()},
                         {"OpenHaptics", Vec3::UnitX(), Vec3::UnitY()},
                         {"gamepad", Vec3::UnitX(), -Vec3::UnitY()},
                         {"any", Vec3(2, -1, 2) / 3, Vec3(2, 2, -1) / 3}};

// The physician looks from the feet: the patient's right, +x, is on the left, as viewer and ultrasound show it.
TEST_F(HandLoopTest, RightUpAndInAreTheScreens) {
  for (const Axes& axes : kDevices) {
    mapping.R_WD = device_in_world(axes.right, axes.up);
    EXPECT_NEAR(mapping.R_WD.determinant(), 1, 1e-12) << axes.device;
    HandLoop loop(hand, mapping);
    hand.p = Vec3(30, -100, 200);
    EXPECT_EQ(loop.run(0)->X_WN->p, mapping.start_tip_mm);
    hand.p += 3 * axes.right + 5 * axes.up + 7 * axes.in();
    const auto moved = loop.run(kMs);
    EXPECT_LT((moved->X_WN->p - mapping.start_tip_mm - Vec3(-3, 5, 7)).norm(), 1e-12) << axes.device;
    EXPECT_EQ(moved->X_WN->R, Mat3(Mat3::Identity())) << axes.device << ": three axes";
  }
}

TEST_F(HandLoopTest, AHandThatTurnsTurnsTheNeedleWithIt) {
  for (const Axes& axes : kDevices) {
    mapping.R_WD = device_in_world(axes.right, axes.up);
    HandLoop loop(hand, mapping);
    Mat3 R;  // the needle points in and a little to the right, its +x to the left
    const Vec3 z = (axes.in() + 0.5 * axes.right).normalized(), y = axes.up, x = y.cross(z);
    R << x, y, z;
    hand.R = R;
    const Mat3 R_WN = loop.run(0)->X_WN->R;
    EXPECT_LT((R_WN.col(2) - Vec3(-0.5, 0, 1).normalized()).norm(), 1e-12) << axes.device;
    EXPECT_LT((R_WN.col(1) - Vec3::UnitY()).norm(), 1e-12) << axes.device;
  }
}

TEST_F(HandLoopTest, TheForcePushesTheHandOutAndToTheSideThatTheTissueIsOn) {
  for (const Axes& axes : kDevices) {
    mapping.R_WD = device_in_world(axes.right, axes.up);
    HandLoop loop(hand, mapping);
    hand.p = Vec3::Zero();
    now_ms = 0;
    run_to(1, loop);
    hand.p = 4 * axes.in();
    lateral_n = Vec3(0.5, 0.25, 0);  // towards the patient's right and front: the screen's left and up
    run_to(60, loop);
    EXPECT_LT((hand.force_n - (-4 * axes.in() - 0.5 * axes.right + 0.25 * axes.up)).norm(), 1e-9)
        << axes.device;
    lateral_n.setZero();
  }
}

TEST_F(HandLoopTest, AHandThatIsNotThereHasNoForceAndMovesNothing) {
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.p.z() = 4;
  hand.button = true;
  run_to(60, loop);
  ASSERT_NEAR(hand.force_n.norm(), 4, 1e-9);
  hand.is_known = false;
  cycle = loop.run(now_ms++ * kMs);
  EXPECT_FALSE(cycle->X_WN);
  EXPECT_EQ(cycle->button, false) << "it presses nothing";
  run_to(80, loop);
  EXPECT_EQ(hand.force_n.norm(), 0);
  // Back within half a second: where it is. Later: the needle is taken up where it was left.
  hand.is_known = true;
  hand.p = Vec3(1, 0, 4);
  EXPECT_EQ(loop.run(100 * kMs)->X_WN->p, mapping.start_tip_mm + Vec3(1, 0, 4));
  hand.is_known = false;
  now_ms = 101;
  run_to(700, loop);
  hand.is_known = true;
  hand.p = Vec3(-50, 80, 20);
  EXPECT_EQ(loop.run(701 * kMs)->X_WN->p, mapping.start_tip_mm + Vec3(1, 0, 4));
  hand.p.z() += 2;
  EXPECT_EQ(loop.run(702 * kMs)->X_WN->p, mapping.start_tip_mm + Vec3(1, 0, 6));
}

TEST_F(HandLoopTest, ADeviceThatHasSaidNothingYetIsNotAtItsOrigin) {
  HandLoop loop(hand, mapping);
  hand.is_known = false;
  EXPECT_FALSE(loop.run(0)->X_WN);
  hand.is_known = true;
  hand.p = Vec3(30, -100, 200);
  EXPECT_EQ(loop.run(kMs)->X_WN->p, mapping.start_tip_mm);
  EXPECT_FALSE(HandReading().p_DN.allFinite()) << "what a driver does not fill in";
}

TEST_F(HandLoopTest, TheForceIsTheModelsInTheDevicesFrame) {
  mapping.R_WD << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.p.y() = 4;  // 4 mm into tissue of 1 N/mm
  run_to(40, loop);
  EXPECT_NEAR(cycle->force_n.z(), -4, 1e-9);
  EXPECT_LT((hand.force_n - Vec3(0, -4, 0)).norm(), 1e-9);
}

TEST_F(HandLoopTest, NoForceExceedsTheDevices) {
  hand.max_force_n = 3;
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.p.z() = 15;
  run_to(60, loop);
  EXPECT_NEAR(hand.force_n.norm(), 3, 1e-9);
}

TEST_F(HandLoopTest, ADaemonThatFallsSilentLeavesNoForceAfter50Ms) {
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.p.z() = 9;
  run_to(61, loop);
  ASSERT_NEAR(hand.force_n.norm(), 9, 1e-9) << "as much as a hand's device renders";
  sends_models = false;  // the last model came at 60 ms
  std::int64_t zero_ms = 0;
  while (zero_ms == 0 && now_ms < 200) {
    run_to(now_ms + 1, loop);
    if (hand.force_n.norm() == 0) zero_ms = now_ms - 1;
  }
  EXPECT_LE(zero_ms - 60, 50);
  run_to(300, loop);
  EXPECT_EQ(hand.force_n.norm(), 0);
}

TEST_F(HandLoopTest, AConnectionThatEndsTakesTheForceAwayAtOnce) {
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.p.z() = 9;
  run_to(61, loop);
  sends_models = false;
  loop.disconnect();
  run_to(61 + 20, loop);  // 9 N at 0.5 N/ms, and a cycle to render it
  EXPECT_EQ(hand.force_n.norm(), 0);
  EXPECT_FALSE(loop.renders_force());
}

TEST_F(HandLoopTest, AReadingThatIsNotFiniteTakesTheForceAway) {
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.p.z() = 2;
  run_to(40, loop);
  ASSERT_GT(hand.force_n.norm(), 0);
  hand.p.x() = NAN;
  run_to(50, loop);
  EXPECT_EQ(hand.force_n.norm(), 0);
}

TEST_F(HandLoopTest, ButtonsAreToldWhenTheyChange) {
  HandLoop loop(hand, mapping);
  EXPECT_EQ(loop.run(0)->button, std::nullopt);
  hand.button = true;
  EXPECT_EQ(loop.run(kMs)->button, true);
  EXPECT_EQ(loop.run(2 * kMs)->button, std::nullopt);
  hand.button = false;
  EXPECT_EQ(loop.run(3 * kMs)->button, false);
}

TEST_F(HandLoopTest, ADeviceThatIsGoneEndsTheLoop) {
  HandLoop loop(hand, mapping);
  run_to(10, loop);
  hand.is_there = false;
  EXPECT_FALSE(loop.run(10 * kMs));
  EXPECT_FALSE(loop.renders_force());
}

}  // namespace
}  // namespace brachy
