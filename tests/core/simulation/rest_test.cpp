// What rests costs nothing: however a needle lies, ticks in which it does not move find the field as it is.
#include <gtest/gtest.h>

#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/sanitized.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

class Rest : public ::testing::TestWithParam<const char*> {};

TEST_P(Rest, OfANeedleInAnyDirectionIsIdle) {
  Scene scene;
  scene.tissue.points = 1500;
  if (GetParam() != std::string("rigid")) {
    scene.needle.flexible = true;
    scene.needle.guide_at = GetParam();
  }
  const auto model = load_simulation_model(scene, load_tissue(scene).tissue);
  std::mt19937_64 random(7);
  const int directions = test::kIsSanitized ? 2 : test::scene_count(16);
  for (int i = 0; i < directions; ++i) {
    const Vec3 axis = test::uniform_point(random, 1).normalized(), goal = test::uniform_point(random, 8);
    const Vec3 aside = goal + axis.unitOrthogonal();
    Simulator simulator(model);
    MeshState state = simulator.initial_state();
    for (const Vec3& tip : test::straight(goal - 45 * axis, goal, 0.3))
      simulator.step(needle_pose(pose_at(tip, axis)), state);
    for (const Vec3& tip : test::straight(goal, aside, 0.3))
      simulator.step(needle_pose(pose_at(tip, axis)), state);
    ASSERT_EQ(state.needles.states[0].contact, ContactState::kInserted);
    for (int tick = 0; tick < 20; ++tick)
      simulator.step(needle_pose(pose_at(aside, axis)), state);  // what is late
    const std::uint64_t idle_before = simulator.evaluation_counts()[0];
    constexpr int kTicks = 400;
    for (int tick = 0; tick < kTicks; ++tick) simulator.step(needle_pose(pose_at(aside, axis)), state);
    EXPECT_GE(simulator.evaluation_counts()[0] - idle_before, 0.99 * kTicks) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Simulation, Rest, testing::Values("rigid", "none", "template"),
                         [](const auto& needle) { return std::string(needle.param); });

}  // namespace
}  // namespace brachy
