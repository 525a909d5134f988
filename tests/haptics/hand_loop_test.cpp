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
    reading = {at, button};
    return is_there;
  }

  double max_force_n = 9;
  RigidTransform at;
  bool button = false, is_there = true;
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
  bool sends_models = true;
  std::optional<HandLoop::Cycle> cycle;
};

TEST_F(HandLoopTest, TheFirstReadingIsTheStartAndMovementsAreTurnedAndScaled) {
  mapping.R_WD << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // the device's y is the world's z
  mapping.scale = 2;
  HandLoop loop(hand, mapping);
  hand.at.p = Vec3(30, -100, 200);
  EXPECT_EQ(loop.run(0)->X_WN.p, mapping.start_tip_mm);
  hand.at.p += Vec3(1, 5, 0);
  EXPECT_EQ(loop.run(kMs)->X_WN.p, mapping.start_tip_mm + Vec3(2, 0, 10));
}

TEST_F(HandLoopTest, TheForceIsTheModelsInTheDevicesFrame) {
  mapping.R_WD << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.at.p.y() = 4;  // 4 mm into tissue of 1 N/mm
  run_to(40, loop);
  EXPECT_NEAR(cycle->force_n.z(), -4, 1e-9);
  EXPECT_LT((hand.force_n - Vec3(0, -4, 0)).norm(), 1e-9);
}

TEST_F(HandLoopTest, NoForceExceedsTheDevices) {
  hand.max_force_n = 3;
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.at.p.z() = 15;
  run_to(60, loop);
  EXPECT_NEAR(hand.force_n.norm(), 3, 1e-9);
}

TEST_F(HandLoopTest, ADaemonThatFallsSilentLeavesNoForceAfter50Ms) {
  HandLoop loop(hand, mapping);
  run_to(1, loop);
  hand.at.p.z() = 9;
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
  hand.at.p.z() = 9;
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
  hand.at.p.z() = 2;
  run_to(40, loop);
  ASSERT_GT(hand.force_n.norm(), 0);
  hand.at.p.x() = NAN;
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
