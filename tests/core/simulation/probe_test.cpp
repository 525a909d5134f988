// The transrectal probe: it pushes the gland, which goes out of its way.
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/simulation/state_hash.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

Scene probe_scene(bool moves = false) {
  Scene scene;
  scene.tissue.points = 2500;
  scene.probe.on = true;
  scene.gland.moves = moves;
  return scene;
}

class ProbeAtTheGland {
 public:
  explicit ProbeAtTheGland(const Scene& scene)
      : radius(0.5 * scene.probe.diameter_mm + scene.probe.rectal_wall_mm),
        simulator(load_simulation_model(scene, load_tissue(scene).tissue)),
        poses(scene.instrument_count()) {}

  const MeshState& step() {
    simulator.step(poses, state);
    flags |= state.summary.step_flags;
    return state;
  }
  void put(const Vec3& tip) {
    poses.back() = needle_pose(pose_at(tip, Vec3::UnitZ()));
    step();
  }
  // So far towards the gland, from where it only touches its back, with the tip 20 mm beyond its middle.
  void push(double depth) { put(axis_at(depth)); }
  Vec3 axis_at(double depth, double tip_z = 30) const { return {0, back() - radius + depth, tip_z}; }
  double back() const {
    double y = 0;
    for (std::size_t i = 0; i < simulator.tissue().surface_count; ++i)
      y = std::min(y, simulator.tissue().rest_vertices[i].y());
    return y;
  }
  void go(const Vec3& to, double stride = 0.1) {
    for (const Vec3& tip : test::straight(poses.back().X_WN.p, to, stride)) put(tip);
  }
  // How far the surface is inside the probe and its wall, at most: between landmarks and beyond the last of them the
  // wall gives way. Wider cores would not let it in, but push with a quarter more force than the tissue's
  // (gland_reference_test.cpp).
  double deepest() const {
    double inside = 0;
    const Vec3 tip = poses.back().X_WN.p;
    for (std::size_t i = 0; i < simulator.tissue().surface_count; ++i) {
      const Vec3 x = at(i), on_axis(tip.x(), tip.y(), std::min(x.z(), tip.z() - 10));
      inside = std::max(inside, radius - (x - on_axis).norm());
    }
    return inside;
  }
  Vec3 at(std::size_t i) const {
    const float* x = &state.mesh.deformed_vertices[3 * i];
    return Eigen::Vector3f(x[0], x[1], x[2]).cast<double>();
  }
  Vec3 mean_motion() const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < simulator.tissue().size(); ++i)
      sum += at(i) - simulator.tissue().rest_vertices[i];
    return sum / static_cast<double>(simulator.tissue().size());
  }
  const NeedleState& probe() const { return state.needles.states.back(); }

  double radius;
  Simulator simulator;
  std::vector<NeedlePose> poses;
  MeshState state = simulator.initial_state();
  std::uint32_t flags = 0;
};

constexpr std::uint32_t kBad =
    kStepFolded | kStepUncertified | kStepClamped | kStepSolveFailed | kStepDropped;

TEST(Probe, DentsTheGlandAndLeavesItAtRest) {
  ProbeAtTheGland run(probe_scene());
  const std::vector<float> rest = run.state.mesh.deformed_vertices;
  run.push(-1);
  EXPECT_EQ(run.probe().contact, ContactState::kFree);
  EXPECT_EQ(run.probe().forces.force_n, Vec3::Zero());
  for (const double depth : {2.0, 4.0, 6.0}) {
    run.go(run.axis_at(depth));
    EXPECT_EQ(run.probe().contact, ContactState::kTouching);
    EXPECT_LT(run.deepest(), 0.27 * depth) << depth;
    EXPECT_GT(run.deepest(), -0.1) << depth;
    EXPECT_EQ(run.flags & kBad, 0u) << depth;
    EXPECT_LT(run.probe().forces.force_n.y(), 0);  // pushed back
  }
  run.go(run.axis_at(-1));
  EXPECT_EQ(run.state.mesh.deformed_vertices, rest);
  EXPECT_EQ(run.probe().contact, ContactState::kFree);
}

// 30 N move the peripheral zone by about 12 mm; most of it is the gland's way on its ligaments.
TEST(Probe, ThirtyNewtonsMoveTheGlandTwelveMillimetres) {
  ProbeAtTheGland run(probe_scene(true));
  run.push(-0.2);
  run.go(run.axis_at(12));
  EXPECT_NEAR(run.probe().forces.force_n.norm(), 30, 6);
  EXPECT_LT(run.deepest(), 1);
  EXPECT_GT(run.mean_motion().y(), 2);
  EXPECT_EQ(run.flags & kBad, 0u);
}

TEST(Probe, SlidesAlongTheGlandWithoutDraggingIt) {
  ProbeAtTheGland run(probe_scene(true));
  run.push(-0.2);
  run.go(run.axis_at(5));
  const double before = run.mean_motion().z(), force = run.probe().forces.force_n.z();
  run.go(run.axis_at(5, 40));
  EXPECT_NEAR(run.mean_motion().z(), before, 0.5);
  EXPECT_NEAR(run.probe().forces.force_n.z(), force, 0.5);
  EXPECT_LT(run.deepest(), 0.8);
}

TEST(Probe, PushesAsMuchAtAnotherRate) {
  const auto force_at = [](double hz) {
    Scene scene = probe_scene(true);
    scene.rates.deformation_hz = hz;
    ProbeAtTheGland run(scene);
    run.push(-0.2);
    run.go(run.axis_at(8), 20 / hz);
    return run.probe().forces.force_n.norm();
  };
  const double slow = force_at(200);
  EXPECT_NEAR(force_at(1000), slow, 0.02 * slow);
}

TEST(Probe, LetsANeedleInBesideItAndRepeats) {
  const auto run_once = [] {
    ProbeAtTheGland run(probe_scene(true));
    run.push(-0.2);
    run.go(run.axis_at(4));
    for (const RigidTransform& X_WN : test::insertion()) {
      run.poses[0] = needle_pose(X_WN);
      const std::uint64_t before = test::allocation_count();
      run.step();
      EXPECT_EQ(test::allocation_count(), before);
      EXPECT_LT(run.deepest(), 0.8);
    }
    EXPECT_EQ(run.flags & (kStepFolded | kStepSolveFailed), 0u);
    EXPECT_GT(run.state.needles.states[0].puncture_count, 0u);
    StateHash hash;
    hash.add(run.state);
    return hash.value();
  };
  EXPECT_EQ(run_once(), run_once());
}

TEST(Probe, NeedsAModelThatKnowsForces) {
  Scene scene = probe_scene();
  scene.model.kernel = "psi31";
  try {
    load_simulation_model(scene, load_tissue(scene).tissue);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("probe.on"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace brachy
