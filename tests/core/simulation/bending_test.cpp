// Needles that bend, in whole simulations.
#include <gtest/gtest.h>

#include "core/simulation/state_hash.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

Scene flexible_scene() {
  Scene scene;
  scene.tissue.points = 2000;
  scene.needle.flexible = true;
  scene.needle.inner_diameter_mm = 1.0;
  scene.needle.guide_at = "template";
  return scene;
}

class Insertion {
 public:
  explicit Insertion(const Scene& scene)
      : simulator(load_simulation_model(scene, load_tissue(scene).tissue)) {}

  const NeedleState& step(const Vec3& tip, const Vec3& axis = Vec3::UnitZ()) {
    simulator.step(needle_pose(pose_at(tip, axis)), state);
    flags |= state.summary.step_flags;
    hash.add(state);
    return state.needles.states[0];
  }
  const NeedleState& go(const Vec3& from, const Vec3& to, double stride) {
    for (const Vec3& tip : test::straight(from, to, stride)) step(tip);
    return state.needles.states[0];
  }

  Simulator simulator;
  MeshState state = simulator.initial_state();
  std::uint32_t flags = 0;
  StateHash hash;
};

const Vec3 kOutside{0, 0, -30}, kInside{0, 0, 18};  // where the capsule lies across the needle

std::uint64_t hash_of(const Scene& scene) {
  Insertion run(scene);
  for (const RigidTransform& X_WN : test::insertion()) {
    run.simulator.step(needle_pose(X_WN), run.state);
    run.hash.add(run.state);
  }
  return run.hash.value();
}

TEST(Bending, OfAnInfinitelyStiffNeedleIsTheRigidOneBitForBit) {
  Scene scene = flexible_scene();
  scene.needle.bevel_force_share = 0.2;
  const std::uint64_t bent = hash_of(scene);
  scene.needle.youngs_modulus_gpa = 1e12;
  const std::uint64_t stiff = hash_of(scene);
  scene.needle = {};
  EXPECT_EQ(stiff, hash_of(scene));
  EXPECT_NE(bent, stiff);
}

// The stiffer, the nearer to the rigid needle, by the inverse of the stiffness.
TEST(Bending, GoesToTheRigidNeedleAsStiffnessGrows) {
  Scene scene = flexible_scene();
  scene.needle.guide_at = "none";
  const auto lateral = [&](double modulus_gpa) {
    scene.needle.youngs_modulus_gpa = modulus_gpa;
    Insertion run(scene);
    run.go(kOutside, kInside, 0.25);
    return run.go(kInside, kInside + Vec3(1, 0, 0), 0.25).forces.lateral_n;
  };
  const double rigid = lateral(1e12);
  EXPECT_GT(rigid, 0.3);
  const double off1 = rigid - lateral(1e7), off2 = rigid - lateral(2e7);
  EXPECT_GT(off1, 0);
  EXPECT_LT(off1, 3e-3 * rigid);
  EXPECT_NEAR(off1 / off2, 2, 0.05);
  EXPECT_LT(lateral(1e-2), 0.01 * rigid);  // a thread pushes nothing aside
}

// Between hand and tissue: pushed aside by 1 mm, needle and tissue give in proportion to their compliance.
TEST(Bending, SharesAPushBetweenNeedleAndTissue) {
  Scene scene = flexible_scene();
  scene.needle.guide_at = "none";
  Insertion run(scene);
  run.go(kOutside, kInside, 0.25);
  const NeedleState& needle = run.go(kInside, kInside + Vec3(2, 0, 0), 0.1);
  ASSERT_TRUE(needle.shape.is_bent);
  EXPECT_LT(needle.shape.tip_deflection.x(), -1.5);  // the tip hardly moves
  EXPECT_GT(needle.shape.tip_deflection.x(), -2.3);  // beyond its line: the shaft is a lever
  EXPECT_NEAR(needle.shape.tip_deflection.z(), 0, 1e-12);
  EXPECT_EQ(needle.shape.points.back(), Vec3(needle.X_WN.p + needle.shape.tip_deflection));
  EXPECT_LT((needle.shape.points.front() - (needle.X_WN.p - Vec3(0, 0, 200))).norm(), 1e-9);
  // The hand feels what the tissue does to the needle.
  EXPECT_GT(needle.forces.lateral_n, 0.001);
  EXPECT_LT(needle.forces.force_n.x(), 0);
}

TEST(Bending, ABevelSteersTheNeedleToItsSide) {
  Scene scene = flexible_scene();
  Insertion symmetric(scene);  // the phantom is not
  const Vec3 without = symmetric.go(kOutside, kInside, 0.1).shape.tip_deflection;
  scene.needle.bevel_force_share = 0.1;
  Insertion straight(scene);
  const Vec3 there = straight.go(kOutside, kInside, 0.1).shape.tip_deflection - without;
  EXPECT_GT(there.x(), 0.5);
  EXPECT_LT(std::abs(there.y()), 0.05 * there.x());
  EXPECT_EQ(straight.flags & (kStepSteep | kStepClamped | kStepFolded), 0u);
  scene.needle.bevel_deg = 90;
  Insertion turned(scene);
  const Vec3 aside = turned.go(kOutside, kInside, 0.1).shape.tip_deflection - without;
  EXPECT_NEAR(aside.y(), there.x(), 0.1 * there.x());
  EXPECT_LT(std::abs(aside.x()), 0.05 * there.x());
}

// Pressed on a slope the tip slides downhill before it punctures, the more the softer the needle is, but not far.
TEST(Bending, ATipSlidesDownAnObliqueCapsule) {
  Scene scene = flexible_scene();
  const Vec3 outside{8, -4, -36}, inside{8, -4, 6};
  Insertion soft(scene);
  const Vec3 there = soft.go(outside, inside, 0.25).shape.tip_deflection;
  EXPECT_GT(there.dot(Vec3(8, -4, 0).normalized()), 1.5);
  EXPECT_LT(there.norm(), 4);
  scene.needle.youngs_modulus_gpa = 1e6;
  Insertion stiff(scene);
  EXPECT_LT(stiff.go(outside, inside, 0.25).shape.tip_deflection.norm(), 0.05);
}

TEST(Bending, DoesNotDependOnTheTickRate) {
  Scene scene = flexible_scene();
  scene.needle.bevel_force_share = 0.1;
  Insertion slow(scene);
  const NeedleState& a = slow.go(kOutside, kInside, 0.25);
  scene.rates.deformation_hz = 1000;
  Insertion fast(scene);
  const NeedleState& b = fast.go(kOutside, kInside, 0.05);
  EXPECT_LT((a.shape.tip_deflection - b.shape.tip_deflection).norm(), 0.02 * b.shape.tip_deflection.norm());
  EXPECT_NEAR(a.forces.axial_n, b.forces.axial_n, 0.02 * b.forces.axial_n);
}

TEST(Bending, LeavesTheTissueAtRestBitForBitAndAllocatesNothing) {
  Scene scene = flexible_scene();
  scene.needle.bevel_force_share = 0.1;
  Insertion run(scene);
  const std::vector<float> rest = run.state.mesh.deformed_vertices;
  run.step(kOutside);
  std::vector<Vec3> tips = test::straight(kOutside, kInside, 0.25);
  for (const Vec3& tip : test::straight(kInside, kOutside, 0.25)) tips.push_back(tip);
  const std::uint64_t before = test::allocation_count();
  for (const Vec3& tip : tips) run.step(tip);
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_EQ(run.state.mesh.deformed_vertices, rest);
  EXPECT_EQ(run.state.needles.states[0].shape.tip_deflection, Vec3(Vec3::Zero()));
}

TEST(Bending, IsCertifiedAllTheWay) {
  Scene scene = flexible_scene();
  scene.needle.bevel_force_share = 0.2;
  Insertion run(scene);
  run.go(kOutside, kInside, 0.25);
  run.go(kInside, kInside + Vec3(3, 1, 0), 0.25);
  run.go(kInside + Vec3(3, 1, 0), kOutside, 0.25);
  EXPECT_EQ(run.flags & (kStepFolded | kStepUncertified | kStepClamped | kStepSolveFailed), 0u);
}

// The hand gets no work out of a needle that bends: what it stores it gives back.
TEST(Bending, CreatesNoEnergy) {
  std::mt19937_64 random(12);
  Scene scene = flexible_scene();
  scene.needle.guide_at = "none";
  Insertion run(scene);
  const int loops = test::kIsSanitized ? 1 : 10;
  for (int loop = 0; loop < loops; ++loop) {
    const Vec3 goal = test::uniform_point(random, 8), outside = goal - 45 * Vec3::UnitZ();
    std::vector<Vec3> points = {outside};
    for (int k = 0; k < 4; ++k)
      points.push_back(goal + test::uniform(random, -28, 8) * Vec3::UnitZ() +
                       test::uniform_point(random, 1.5));
    points.push_back(outside);
    double work = 0, through = 0;
    Vec3 last_force = Vec3::Zero(), last_tip = outside;
    run.step(outside);
    for (std::size_t p = 1; p < points.size(); ++p)
      for (const Vec3& tip : test::straight(points[p - 1], points[p], 0.4)) {
        const Vec3 force = run.step(tip).forces.force_n;
        const double done = -0.5 * (force + last_force).dot(tip - last_tip);
        work += done;
        through += std::abs(done);
        last_force = force;
        last_tip = tip;
      }
    EXPECT_GE(work, -1e-3 * through) << loop;
  }
}

}  // namespace
}  // namespace brachy
