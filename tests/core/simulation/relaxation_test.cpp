// Reactions that relax while the needle rests.
#include <gtest/gtest.h>

#include "core/simulation/state_hash.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/sanitized.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

Scene relaxing_scene() {
  Scene scene;
  scene.tissue.points = 2000;
  scene.contact.relaxation_share = 0.5;
  scene.contact.relaxation_s = 2;
  return scene;
}

class Rests {
 public:
  explicit Rests(const Scene& scene) : simulator(load_simulation_model(scene, load_tissue(scene).tissue)) {}
  const NeedleState& put(const Vec3& tip) {
    simulator.step(test::needle_pose(test::pose_at(tip, Vec3::UnitZ())), state);
    flags |= state.summary.step_flags;
    return state.needles.states[0];
  }
  const NeedleState& go(const Vec3& from, const Vec3& to, double stride) {
    for (const Vec3& tip : test::straight(from, to, stride)) put(tip);
    return state.needles.states[0];
  }
  double rest_for(double seconds, const Vec3& tip) {
    for (double t = 0; t < seconds; t += simulator.period_s()) put(tip);
    return state.needles.states[0].forces.axial_n;
  }
  Simulator simulator;
  MeshState state = simulator.initial_state();
  std::uint32_t flags = 0;
};

const Vec3 kBefore{2, -3, -36}, kIn{2, -3, 10};

TEST(Relaxation, AStoppedNeedleKeepsHalfItsForce) {
  Rests run(relaxing_scene());
  const double moving = run.go(kBefore, kIn, 0.25).forces.axial_n;
  EXPECT_NEAR(moving, 3 + 0.02 * run.state.needles.states[0].insertion_depth_mm, 0.1);
  const double after_one = run.rest_for(2, kIn), after_five = run.rest_for(18, kIn);
  EXPECT_GT(after_one, 0.6 * moving);
  EXPECT_LT(after_one, 0.85 * moving);
  EXPECT_NEAR(after_five, 0.5 * moving, 0.06 * moving);
  // It goes on: the full force comes back.
  EXPECT_NEAR(run.go(kIn, kIn + Vec3(0, 0, 8), 0.25).forces.axial_n, moving + 0.15, 0.15);
  EXPECT_EQ(run.flags & (kStepFolded | kStepUncertified | kStepClamped), 0u);
}

TEST(Relaxation, WithoutAShareNothingChanges) {
  Scene scene = relaxing_scene();
  scene.contact.relaxation_share = 0;
  Rests run(scene);
  const double moving = run.go(kBefore, kIn, 0.25).forces.axial_n;
  EXPECT_NEAR(run.rest_for(4, kIn), moving, 1e-3 * moving);
}

TEST(Relaxation, LetsAPressedCapsuleGoOnResisting) {
  Rests run(relaxing_scene());
  const Vec3 pressed{2, -3, -15};
  const NeedleState& needle = run.go(kBefore, pressed, 0.25);
  ASSERT_EQ(needle.contact, ContactState::kTouching);
  const double at_once = needle.forces.axial_n;
  EXPECT_NEAR(run.rest_for(20, pressed), 0.5 * at_once, 0.1 * at_once);
  EXPECT_EQ(run.state.needles.states[0].contact, ContactState::kTouching);
}

TEST(Relaxation, HoldsForANeedleThatBendsInAGlandThatMoves) {
  Scene scene = relaxing_scene();
  scene.needle.flexible = true;
  scene.needle.bevel_force_share = 0.1;
  scene.needle.guide_at = "template";
  scene.gland.moves = true;
  Rests run(scene);
  const double moving = run.go(kBefore, kIn, 0.25).forces.axial_n;
  const double rested = run.rest_for(20, kIn);
  EXPECT_GT(rested, 0.3 * moving);
  EXPECT_LT(rested, 0.75 * moving);  // the gland comes back meanwhile, which strains the tissue again
  EXPECT_EQ(run.flags & (kStepFolded | kStepUncertified | kStepClamped | kStepReinitialized), 0u);
  run.go(kIn, kBefore - Vec3(0, 0, 5), 0.25);
  EXPECT_EQ(run.state.mesh.deformed_vertices, run.simulator.initial_state().mesh.deformed_vertices);
}

TEST(Relaxation, CreatesNoEnergy) {
  std::mt19937_64 random(13);
  Scene scene = relaxing_scene();
  Rests run(scene);
  const int loops = test::kIsSanitized ? 2 : test::scene_count(20);
  for (int loop = 0; loop < loops; ++loop) {
    const Vec3 goal = test::uniform_point(random, 8), outside = goal - 45 * Vec3::UnitZ();
    std::vector<Vec3> points = {outside};
    for (int k = 0; k < 4; ++k)
      points.push_back(goal + test::uniform(random, -28, 8) * Vec3::UnitZ() +
                       test::uniform_point(random, 0.7));
    points.push_back(outside);
    double work = 0, through = 0;
    Vec3 last_force = Vec3::Zero(), last_tip = outside;
    run.put(outside);
    for (std::size_t p = 1; p < points.size(); ++p) {
      for (const Vec3& tip : test::straight(points[p - 1], points[p], 0.4)) {
        const Vec3 force = run.put(tip).forces.force_n;
        const double done = -0.5 * (force + last_force).dot(tip - last_tip);
        work += done;
        through += std::abs(done);
        last_force = force;
        last_tip = tip;
      }
      run.rest_for(0.3, points[p]);
      last_force = run.state.needles.states[0].forces.force_n;
    }
    EXPECT_GE(work, -1e-3 * through) << loop;
  }
}

}  // namespace
}  // namespace brachy
