// The gland as a whole: it moves on its ligaments, and swells.
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/simulation/state_hash.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

Scene moving_scene() {
  Scene scene;
  scene.tissue.points = 2000;
  scene.gland.moves = true;
  return scene;
}

class Needles {
 public:
  explicit Needles(const Scene& scene)
      : simulator(load_simulation_model(scene, load_tissue(scene).tissue)), poses(scene.needle.count) {}

  const MeshState& step() {
    simulator.step(poses, state);
    flags |= state.summary.step_flags;
    return state;
  }
  void put(std::size_t needle, const Vec3& tip) {
    poses[needle] = needle_pose(pose_at(tip, Vec3::UnitZ()));
    step();
  }
  void go(std::size_t needle, const Vec3& from, const Vec3& to, double stride) {
    for (const Vec3& tip : test::straight(from, to, stride)) put(needle, tip);
  }
  Vec3 mean_motion() const {
    const Tissue& tissue = simulator.tissue();
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < tissue.size(); ++i) sum += at(i) - tissue.rest_vertices[i];
    return sum / static_cast<double>(tissue.size());
  }
  Vec3 at(std::size_t i) const {
    const float* x = &state.mesh.deformed_vertices[3 * i];
    return Eigen::Vector3f(x[0], x[1], x[2]).cast<double>();
  }
  const NeedleState& needle(std::size_t n) const { return state.needles.states[n]; }

  Simulator simulator;
  std::vector<NeedlePose> poses;
  MeshState state = simulator.initial_state();
  std::uint32_t flags = 0;
};

const Vec3 kBeforeSkin{1, -3, -36};

// Pressed by a capsule that never gives way: 6 to 8 N move it about 10 mm.
TEST(GlandMotion, SevenNewtonsAlongTheNeedleMoveItTenMillimetres) {
  Scene scene = moving_scene();
  scene.tissue.contact.puncture_force_n = 100;
  Needles needles(scene);
  Vec3 tip = kBeforeSkin;
  for (; needles.state.needles.states[0].forces.axial_n < 7 && tip.z() < 30; tip.z() += 0.1)
    needles.put(0, tip);
  ASSERT_NEAR(needles.needle(0).forces.axial_n, 7, 0.2);
  const Vec3 motion = needles.mean_motion();
  EXPECT_NEAR(motion.z(), 10, 1);
  EXPECT_LT(motion.head<2>().norm(), 1.5);
  EXPECT_EQ(needles.flags & (kStepFolded | kStepUncertified | kStepClamped), 0u);
  // Held there it stays, and at the tip the capsule is where the needle is.
  const double before = needles.mean_motion().z();
  for (int i = 0; i < 20; ++i) needles.step();
  EXPECT_NEAR(needles.mean_motion().z(), before, 0.1);
}

TEST(GlandMotion, LockingNeedlesHalveIt) {
  const auto motion_at_7_n = [](std::size_t locking) {
    Scene scene = moving_scene();
    scene.needle.count = 3;
    scene.needle.locking_count = locking;
    scene.tissue.contact.puncture_force_n = 100;
    Needles needles(scene);
    if (locking > 0) {
      needles.poses[1] = needle_pose(pose_at({-9, -3, 10}, Vec3::UnitZ()));
      needles.poses[2] = needle_pose(pose_at({11, -3, 10}, Vec3::UnitZ()));
    }
    Vec3 tip = kBeforeSkin;
    for (; needles.state.needles.states[0].forces.axial_n < 7 && tip.z() < 30; tip.z() += 0.1)
      needles.put(0, tip);
    return needles.mean_motion().z();
  };
  const double free = motion_at_7_n(0), locked = motion_at_7_n(2);
  EXPECT_GT(free, 8);
  EXPECT_LT(locked, 0.5 * free);
  EXPECT_GT(locked, 0.5);
}

// What the box's walls hold is not counted twice: softer than they allow is all that can be asked for.
TEST(GlandMotion, RefusesAGlandThatTheWallsHoldLess) {
  Scene scene = moving_scene();
  scene.gland.stiffness_n_per_mm.z() = 50;
  try {
    load_simulation_model(scene, load_tissue(scene).tissue);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("gland.stiffness_n_per_mm along z is 50"), std::string::npos)
        << error.what();
  }
  scene = moving_scene();
  scene.model.kernel = "psi31";
  EXPECT_THROW(load_simulation_model(scene, load_tissue(scene).tissue), UserError);
}

// An insertion in which it moves: the landmarks' tissue stays at the needle, forces keep their bounds, and once the
// needle is out everything is where it was, bit for bit.
TEST(GlandMotion, FollowsAnInsertionAndComesBack) {
  Needles needles(moving_scene());
  const std::vector<float> rest = needles.state.mesh.deformed_vertices;
  needles.put(0, kBeforeSkin);
  const Vec3 deep{1, -3, 16};
  const std::vector<Vec3> way = test::straight(kBeforeSkin, deep, 0.25);
  const std::uint64_t before = test::allocation_count();
  double farthest = 0, largest = 0;
  for (const Vec3& tip : way) {
    needles.put(0, tip);
    farthest = std::max(farthest, needles.mean_motion().z());
    largest = std::max(largest, needles.needle(0).forces.axial_n);
  }
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_NEAR(largest, 5.6, 0.1);  // the capsule
  EXPECT_NEAR(farthest, 5.6 / 0.7, 1.2);
  EXPECT_NEAR(needles.needle(0).forces.axial_n, 3 + 0.02 * needles.needle(0).insertion_depth_mm, 0.15);
  EXPECT_GT(needles.mean_motion().z(), 3);  // dragged along by cutting and friction
  // On the way out friction drags it the other way.
  needles.go(0, deep, deep - Vec3(0, 0, 12), 0.25);
  EXPECT_LT(needles.mean_motion().z(), 0);
  needles.go(0, deep - Vec3(0, 0, 12), kBeforeSkin - Vec3(0, 0, 5), 0.25);
  EXPECT_EQ(needles.needle(0).contact, ContactState::kWithdrawn);
  EXPECT_EQ(needles.state.mesh.deformed_vertices, rest);
  EXPECT_EQ(needles.flags & (kStepFolded | kStepUncertified | kStepClamped | kStepReinitialized), 0u);
}

TEST(GlandMotion, DoesNotDependOnTheTickRate) {
  Scene scene = moving_scene();
  Needles slow(scene);
  slow.go(0, kBeforeSkin, {1, -3, 16}, 0.25);
  scene.rates.deformation_hz = 1000;
  Needles fast(scene);
  fast.go(0, kBeforeSkin, {1, -3, 16}, 0.05);
  EXPECT_NEAR(slow.mean_motion().z(), fast.mean_motion().z(), 0.02 * fast.mean_motion().z());
  EXPECT_NEAR(slow.needle(0).insertion_depth_mm, fast.needle(0).insertion_depth_mm, 0.3);
  EXPECT_NEAR(slow.needle(0).forces.axial_n, fast.needle(0).forces.axial_n, 0.02 * 3.5);
}

// Pushed beside its axis it turns about its apex.
TEST(GlandMotion, TurnsAboutItsApex) {
  Needles needles(moving_scene());
  needles.go(0, {10, 0, -36}, {10, 0, 5}, 0.25);
  const Tissue& tissue = needles.simulator.tissue();
  // The side with the needle goes up, the other one less.
  Vec3 with = Vec3::Zero(), without = Vec3::Zero();
  double n_with = 0, n_without = 0;
  for (std::size_t i = 0; i < tissue.size(); ++i) {
    const Vec3& X = tissue.rest_vertices[i];
    if (X.x() > 12) with += needles.at(i) - X, ++n_with;
    if (X.x() < -12) without += needles.at(i) - X, ++n_without;
  }
  EXPECT_GT(with.z() / n_with, without.z() / n_without + 1);
}

// Seeds are dropped where the needle is, in the gland that has moved, and go back with it.
TEST(GlandMotion, SeedsFallInTheMovedGlandAndRideHome) {
  Scene scene = moving_scene();
  Needles needles(scene);
  const Vec3 deep{1, -3, 16};
  needles.go(0, kBeforeSkin, deep, 0.25);
  const double carried = needles.mean_motion().z();
  needles.poses[0].button = true;
  needles.step();
  ASSERT_EQ(needles.state.seeds.count, 1u);
  EXPECT_LT((needles.state.seeds.slots[0].position - deep).norm(), 1e-3);
  const Vec3 outside = kBeforeSkin - Vec3(0, 0, 5);
  for (const Vec3& tip : test::straight(deep, outside, 0.25)) {
    needles.poses[0] = needle_pose(pose_at(tip, Vec3::UnitZ()));
    needles.step();
  }
  const Seed& seed = needles.state.seeds.slots[0];
  EXPECT_EQ(seed.position, seed.rest);
  EXPECT_LT(seed.position.z(), deep.z() - 0.8 * carried);
}

TEST(Swelling, FollowsThePuncturesAndStretchesTheGlandAboutItsApex) {
  Scene scene;
  scene.tissue.points = 2000;
  scene.swelling.on = true;
  scene.swelling.build_up_s = 0.1;
  Needles needles(scene);
  const auto volume = [&] {
    const Tissue& tissue = needles.simulator.tissue();
    double sum = 0;
    for (const auto& t : tissue.triangles)
      sum += needles.at(t[0]).dot(needles.at(t[1]).cross(needles.at(t[2]))) / 6;
    return sum;
  };
  const double before = volume();
  for (int puncture = 0; puncture < 2; ++puncture) {
    const Vec3 outside{puncture * 8.0, -3, -36};
    needles.go(0, outside, outside + Vec3(0, 0, 45), 0.5);
    needles.go(0, outside + Vec3(0, 0, 45), outside, 0.5);
  }
  for (int i = 0; i < 400; ++i) needles.step();
  // 2.5 of 37 cc after two, of which some are lost to linear interpolation of the stretches.
  EXPECT_NEAR(volume() / before, 1 + 2.5 / 37, 0.005);
  EXPECT_EQ(needles.flags & (kStepFolded | kStepSolveFailed), 0u);
  EXPECT_NEAR(SwellingSettings::stretch(1).prod(), 1.01 * 1.11 * 1.08, 1e-12);
}

TEST(Swelling, IsAsDeepUnderTheNeedle) {
  Scene scene;
  scene.tissue.points = 2000;
  scene.swelling.on = true;
  Needles needles(scene);
  needles.go(0, kBeforeSkin, {1, -3, 16}, 0.25);
  EXPECT_NEAR(needles.needle(0).forces.axial_n, 3 + 0.02 * needles.needle(0).insertion_depth_mm, 0.15);
  EXPECT_EQ(needles.flags & (kStepFolded | kStepUncertified | kStepClamped | kStepReinitialized), 0u);
}

}  // namespace
}  // namespace brachy
