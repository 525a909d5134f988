// A needle that comes to the tissue from the side: it pushes across itself, punctures nothing, and lets go smoothly.
#include <gtest/gtest.h>

#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/sanitized.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

Scene coarse_scene() {
  Scene scene;
  scene.tissue.points = 1500;
  return scene;
}

/// A way of a needle across itself, through or past the gland: with its shaft, or with the end that has the tip.
struct Sweep {
  Vec3 axis, push, from, to;
};

Sweep random_sweep(std::mt19937_64& random, bool by_shaft) {
  Sweep sweep;
  sweep.axis = test::uniform_point(random, 1).normalized();
  const Vec3 any = test::uniform_point(random, 1);
  sweep.push = (any - any.dot(sweep.axis) * sweep.axis).normalized();
  const double along = by_shaft ? test::uniform(random, 30, 60) : test::uniform(random, -15, 15);
  const Vec3 middle = along * sweep.axis + test::uniform(random, -15, 15) * sweep.axis.cross(sweep.push);
  sweep.from = middle - 30 * sweep.push;  // outside: the gland's half axes are 24 mm and less
  sweep.to = middle + 30 * sweep.push;
  return sweep;
}

struct Felt {
  double most_n = 0, most_axial_n = 0, largest_change_n = 0, work_nmm = 0, through_nmm = 0;
  std::uint32_t punctures = 0;
  bool at_rest = false, is_finite = true;
};

Felt feel(const std::shared_ptr<const SimulationModel>& model, const Sweep& sweep, double speed_mm_s) {
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  const std::vector<float> rest = state.mesh.deformed_vertices;
  Felt felt;
  Vec3 last_force = Vec3::Zero(), last_tip = sweep.from;
  const double stride = speed_mm_s * simulator.period_s();
  for (const Vec3& tip : test::straight(sweep.from, sweep.to, stride)) {
    simulator.step(needle_pose(pose_at(tip, sweep.axis)), state);
    const NeedleState& needle = state.needles.states[0];
    const Vec3 force = needle.forces.force_n;
    felt.is_finite &= needle.forces.is_finite();
    felt.most_n = std::max(felt.most_n, force.norm());
    felt.most_axial_n = std::max(felt.most_axial_n, std::abs(force.dot(sweep.axis)));
    felt.largest_change_n = std::max(felt.largest_change_n, (force - last_force).norm());
    const double done = -0.5 * (force + last_force).dot(tip - last_tip);
    felt.work_nmm += done;
    felt.through_nmm += std::abs(done);
    felt.punctures = needle.puncture_count;
    last_force = force;
    last_tip = tip;
  }
  felt.at_rest = state.mesh.deformed_vertices == rest;
  return felt;
}

TEST(LateralTouch, IsLateralWhereverAndHoweverFastTheNeedleComes) {
  const auto model = load_simulation_model(coarse_scene(), load_tissue(coarse_scene()).tissue);
  std::mt19937_64 random(5);
  const int sweeps = test::kIsSanitized ? 4 : test::scene_count(12);
  for (int i = 0; i < sweeps; ++i) {
    const Sweep sweep = random_sweep(random, i % 2 == 0);
    const double speed_mm_s = std::pow(300.0, test::uniform(random, 0.5, 1));  // 17 … 300
    const Felt felt = feel(model, sweep, speed_mm_s);
    EXPECT_TRUE(felt.is_finite) << i;
    EXPECT_LT(felt.most_axial_n, 1e-9) << i << ": nothing rubs along it";
    EXPECT_EQ(felt.punctures, 0u) << i;
    EXPECT_LT(felt.most_n, 15) << i;
    EXPECT_GE(felt.work_nmm, 0) << i;
    EXPECT_TRUE(felt.at_rest) << i;
  }
}

// At 1 mm/s no tick changes the force by half a newton, neither where it begins nor where the needle lets go; those in
// every run of the tests go twice as fast.
TEST(LateralTouch, ChangesSmoothly) {
  const auto model = load_simulation_model(coarse_scene(), load_tissue(coarse_scene()).tissue);
  std::mt19937_64 random(5);
  const int sweeps = test::kIsSanitized ? 1 : std::max(2, test::scene_count(20) / 10);
  const double speed_mm_s = sweeps > 2 ? 1 : 2;
  for (int i = 0; i < sweeps; ++i) {
    const Felt felt = feel(model, random_sweep(random, i % 2 == 0), speed_mm_s);
    EXPECT_LT(felt.largest_change_n, 0.5) << i;
  }
}

// The issue's own needle: along z with its tip at z = 10, from the right to the gland.
TEST(LateralTouch, DoesNotPunctureAlongTheAxis) {
  const auto model = load_simulation_model(coarse_scene(), load_tissue(coarse_scene()).tissue);
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  double last = 0;
  for (const Vec3& tip : test::straight({40, 0, 10}, {15, 0, 10}, 0.1)) {
    simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
    const NeedleForces& forces = state.needles.states[0].forces;
    ASSERT_EQ(forces.axial_n, 0) << tip.x();
    ASSERT_NEAR(forces.lateral_n, last, 0.5) << tip.x();
    last = forces.lateral_n;
  }
  EXPECT_EQ(state.needles.states[0].contact, ContactState::kTouching);
  EXPECT_GT(state.needles.states[0].forces.force_n.x(), 1) << "back to the right";
  EXPECT_EQ(state.needles.states[0].puncture_count, 0u);
}

// Once it goes along itself the tip presses by the capsule's law: the puncture takes the law's work.
TEST(LateralTouch, PuncturesByAxialWorkAlone) {
  const auto model = load_simulation_model(coarse_scene(), load_tissue(coarse_scene()).tissue);
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  const Vec3 surface = model->surface.first_hit({40, 0, -4}, {0, 0, -4})->point,
             beside = surface - Vec3(1.5, 0, 0);
  for (const Vec3& tip : test::straight({40, 0, -4}, beside, 0.1))
    simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
  ASSERT_EQ(state.needles.states[0].contact, ContactState::kTouching);
  double work = 0, last = 0, way = 0;
  for (way = 0; way < 15 && state.needles.states[0].puncture_count == 0; way += 0.05) {
    simulator.step(needle_pose(pose_at(beside + (way + 0.05) * Vec3::UnitZ(), Vec3::UnitZ())), state);
    const double axial = state.needles.states[0].forces.axial_n;
    work += 0.5 * (axial + last) * 0.05;
    last = axial;
  }
  ASSERT_EQ(state.needles.states[0].puncture_count, 1u);
  const double indentation = 7.48, law = 0.15 * indentation * indentation + 0.02 * std::pow(indentation, 3);
  EXPECT_GT(way, indentation - 0.1);
  EXPECT_GT(work, 0.98 * law);
}

// Pressed on the capsule's slope and dragged uphill the tip comes to lie deeper without having pressed.
TEST(LateralTouch, DraggingAPressedTipUphillPressesNoMore) {
  const auto model = load_simulation_model(coarse_scene(), load_tissue(coarse_scene()).tissue);
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  const Vec3 pressed = model->surface.first_hit({14, 0, -40}, {14, 0, 0})->point + Vec3(0, 0, 3);
  for (const Vec3& tip : test::straight({14, 0, -40}, pressed, 0.1))
    simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
  ASSERT_EQ(state.needles.states[0].contact, ContactState::kTouching);
  const double before = state.needles.states[0].forces.axial_n;
  ASSERT_GT(before, 0.3);
  for (const Vec3& tip : test::straight(pressed, pressed - 8 * Vec3::UnitX(), 0.1)) {
    simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
    ASSERT_LE(state.needles.states[0].forces.axial_n, before + 1e-6) << tip.x();
  }
  EXPECT_EQ(state.needles.states[0].puncture_count, 0u);
}

// Its last landmark is a needle's end, not a blunt core: what is pushed aside is let go of as the shaft comes out.
TEST(LateralTouch, ANeedleThatIsAsideComesOutWithoutAJump) {
  const auto model = load_simulation_model(coarse_scene(), load_tissue(coarse_scene()).tissue);
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  const Vec3 surface = model->surface.first_hit({8, -4, -40}, {8, -4, 0})->point;
  const Vec3 in = surface + Vec3(0, 0, 12), aside = in + Vec3(2, 0, 0);
  for (const Vec3& tip : test::straight({8, -4, -40}, in, 0.1))
    simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
  ASSERT_EQ(state.needles.states[0].contact, ContactState::kInserted);
  for (const Vec3& tip : test::straight(in, aside, 0.1))
    simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
  double last = state.needles.states[0].forces.lateral_n;
  EXPECT_GT(last, 0.3);
  for (const Vec3& tip : test::straight(aside, aside - Vec3(0, 0, 20), 0.05)) {
    simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
    const double lateral = state.needles.states[0].forces.lateral_n;
    ASSERT_LT(std::abs(lateral - last), 0.5) << tip.z();  // 2.5 with one core
    last = lateral;
  }
  EXPECT_EQ(last, 0);
}

// A needle that turns over in one tick has jumped: it is where its pose says, with no force.
TEST(LateralTouch, AnAxisThatFlipsReinitializesTheContact) {
  const auto model = load_simulation_model(coarse_scene(), load_tissue(coarse_scene()).tissue);
  for (const Vec3& flipped : {Vec3(1, 0, 0), Vec3(0, 0, -1)}) {
    Simulator simulator(model);
    MeshState state = simulator.initial_state();
    for (const Vec3& tip : test::straight({0, 0, -40}, {0, 0, 10}, 0.25))
      simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
    simulator.step(needle_pose(pose_at({0, 0, 10}, flipped)), state);
    EXPECT_NE(state.summary.step_flags & kStepReinitialized, 0u);
    EXPECT_LT(state.needles.states[0].forces.force_n.norm(), 1e-9);
  }
}

}  // namespace
}  // namespace brachy
