#include "core/simulation/instruments.h"

#include <gtest/gtest.h>

#include "tests/core/simulation/tick_parts.h"

namespace brachy {
namespace {

using test::TickParts;

Scene two_needles() {
  Scene scene = TickParts::small_phantom();
  scene.needle.count = 2;
  return scene;
}

TEST(Instruments, APoseIsTakenAndEachNeedleGoesItsOwnWay) {
  TickParts parts(two_needles());
  parts.step({{8, -4, -40}, {-8, -4, -60}});
  for (double z = -40; z <= 0; z += 0.5) parts.step({{8, -4, z}, {-8, -4, -60}});
  ASSERT_TRUE(parts.is_solved);
  EXPECT_TRUE(parts.instruments.is_in_tissue(0));
  EXPECT_FALSE(parts.instruments.is_in_tissue(1));
  EXPECT_EQ(parts.instruments.punctures(), 1u);

  NeedleStates told;
  told.pose_histories.resize(2);
  parts.instruments.write(parts.tick - 3, parts.tick, told);
  ASSERT_EQ(told.states.size(), 2u);
  EXPECT_EQ(told.states[0].contact, ContactState::kInserted);
  EXPECT_GT(told.states[0].insertion_depth_mm, 10);
  EXPECT_EQ(told.states[0].landmark_count, parts.instruments.needles()[0].landmarks().size());
  EXPECT_EQ(told.states[1].contact, ContactState::kFree);
  // Of the ticks that the slot lacked it has the poses, of earlier ones it keeps what it had.
  std::size_t poses = 0;
  for (const TickPose& pose : told.pose_histories[0]) poses += pose.tick > 0;
  EXPECT_EQ(poses, 3u);
  EXPECT_EQ(told.pose_histories[0][parts.tick % NeedleStates::kPoseHistory].X_WN.p, Vec3(8, -4, 0));
}

TEST(Instruments, ANeedleThatIsTakenAwayHasNoLandmarks) {
  TickParts parts;
  for (double z = -40; z <= 0; z += 0.5) parts.step({{8, -4, z}});
  ASSERT_FALSE(parts.instruments.needles()[0].landmarks().empty());
  parts.step({});
  EXPECT_TRUE(parts.instruments.needles()[0].landmarks().empty());
  EXPECT_FALSE(parts.instruments.states()[0].present);
}

// The tick after one whose field is still due: poses are taken, contacts and forces stay.
TEST(Instruments, HeldOnesTakeThePoseAndKeepTheirContact) {
  TickParts parts;
  for (double z = -40; z <= 0; z += 0.5) parts.step({{8, -4, z}});
  NeedleStates before, after;
  before.pose_histories.resize(1);
  after = before;
  parts.instruments.write(0, parts.tick, before);
  const NeedlePose next = test::needle_pose(test::pose_at({8, -4, 2}, Vec3::UnitZ()));
  parts.instruments.hold(parts.tick + 1, {&next, 1});
  parts.instruments.write(parts.tick, parts.tick + 1, after);
  EXPECT_EQ(after.states[0].input.X_WN.p.z(), 2);
  EXPECT_EQ(after.states[0].X_WN.p.z(), 0) << "where the contacts have it";
  EXPECT_EQ(after.states[0].insertion_depth_mm, before.states[0].insertion_depth_mm);
  EXPECT_EQ(after.states[0].forces.force_n, before.states[0].forces.force_n);
  EXPECT_EQ(after.pose_histories[0][(parts.tick + 1) % NeedleStates::kPoseHistory].X_WN.p.z(), 2);

  parts.instruments.hold(parts.tick + 2, {});
  EXPECT_FALSE(parts.instruments.states()[0].present);
  EXPECT_TRUE(parts.instruments.needles()[0].landmarks().empty());
}

// A needle that the tissue holds aside: its points begin at the hand and end at the bent tip.
TEST(Instruments, AShapeGoesFromTheHandToTheBentTip) {
  Scene scene = TickParts::small_phantom();
  scene.needle.flexible = true;
  scene.needle.inner_diameter_mm = 1.0;
  TickParts parts(scene);
  for (double z = -40; z <= 10; z += 0.5) parts.step({{8, -4, z}});
  for (double x = 8; x <= 11; x += 0.1) parts.step({{x, -4, 10}});
  ASSERT_TRUE(parts.is_solved);
  parts.instruments.find_shapes();
  const NeedleShape& shape = parts.instruments.states()[0].shape;
  ASSERT_TRUE(shape.is_bent);
  const Vec3 hub(11, -4, 10 - parts.model->settings.needle.length_mm), tip(11, -4, 10);
  EXPECT_LT((shape.points.front() - hub).norm(), 2);
  EXPECT_NEAR((shape.points.back() - (tip + shape.tip_deflection)).norm(), 0, 1e-9);
  EXPECT_LT(shape.tip_deflection.x(), -0.1) << "the tissue pulls it back";
}

}  // namespace
}  // namespace brachy
