// Needles against organs in a whole simulation: passes by the deformed tissue, bone, seeds that get lost.
#include <gtest/gtest.h>

#include "core/scene/load_structures.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

Scene organ_scene() {
  Scene scene;
  scene.tissue.points = 2000;
  scene.model.kernel = "psi31";
  scene.seeds.max_count = 8;
  return scene;
}

class OrganSession {
 public:
  explicit OrganSession(const Scene& scene)
      : simulator(load_simulation_model(scene, load_tissue(scene).tissue)) {}

  void step(const Vec3& tip, bool button = false) {
    NeedlePose pose = needle_pose(pose_at(tip, Vec3::UnitZ()));
    pose.button = button;
    simulator.step(pose, state);
  }
  void go(const Vec3& from, const Vec3& to, double stride) {
    for (const Vec3& tip : test::straight(from, to, stride)) step(tip);
  }
  const OrganContact& of(const std::string& organ) const {
    const auto names = names_of(simulator.model()->organs);
    const auto found = std::ranges::find(names, organ);
    return state.needles.organ_contacts[static_cast<std::size_t>(found - names.begin())];
  }

  Simulator simulator;
  MeshState state = simulator.initial_state();
};

// In the tube's axis where it is deepest.
TEST(OrgansInASimulation, ThreePassesThroughTheUrethraAreThreeWithTheirDepth) {
  OrganSession session(organ_scene());
  const Vec3 below(0, -4, -45), in(0, -4, 3);
  for (int pass = 0; pass < 3; ++pass) {
    session.go(below, in, 0.25);
    EXPECT_TRUE(session.of("urethra").is_in);
    session.go(in, below, 0.25);
    EXPECT_FALSE(session.of("urethra").is_in);
    EXPECT_EQ(session.of("urethra").passes, static_cast<std::uint32_t>(pass + 1));
    // In the tube's axis where it is deepest; its polygon of 24 sides is within 0.03 mm of the circle.
    EXPECT_NEAR(session.of("urethra").depth_mm, 3, 0.1);
  }
  EXPECT_EQ(session.of("rectum").passes, 0u);
}

TEST(OrgansInASimulation, ANeedleBesideThemTouchesNone) {
  OrganSession session(organ_scene());
  session.go({10, -4, -45}, {10, -4, 10}, 0.25);
  session.go({10, -4, 10}, {10, -4, -45}, 0.25);
  EXPECT_EQ(session.of("urethra").passes, 0u);
  EXPECT_EQ(session.of("rectum").passes, 0u);
}

TEST(OrgansInASimulation, TheRectumBehindTheGlandIsWhereItIsInTheWorld) {
  OrganSession session(organ_scene());
  session.go({0, -30, -60}, {0, -30, 0}, 0.5);
  session.go({0, -30, 0}, {0, -30, -60}, 0.5);
  EXPECT_EQ(session.of("rectum").passes, 1u);
  EXPECT_NEAR(session.of("rectum").depth_mm, 13.5 - 6.5, 0.1);
}

TEST(OrgansInASimulation, TestingAllocatesNothing) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "the sanitizer owns malloc";
  OrganSession session(organ_scene());
  session.go({0, -4, -45}, {0, -4, -20}, 0.25);
  const std::uint64_t before = test::allocation_count();
  for (double z = -20; z < 5; z += 0.25) session.step({0, -4, z});
  EXPECT_EQ(test::allocation_count(), before);
}

TEST(LostSeeds, AreKeptWithPlaceAndReasonAndDoNotComeBack) {
  Scene scene = organ_scene();
  OrganSession session(scene);
  const Vec3 in_hand(5, 5, scene.template_grid.origin_mm.z() - 20);
  session.step(in_hand);
  session.step(in_hand, true);
  EXPECT_EQ(session.state.seeds.count, 0u);
  ASSERT_EQ(session.state.failed_drops.count, 1u);
  const FailedDrop& drop = session.state.failed_drops.slots[0];
  EXPECT_EQ(drop.why, DropRefusal::kLost);
  EXPECT_EQ(drop.at, in_hand);
  EXPECT_EQ(drop.tick, 2u);
}

}  // namespace
}  // namespace brachy
