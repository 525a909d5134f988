// Sixteen needles on the move: what a tick has no time for comes later, and where that is the whole field forces and
// field take turns (Allowance::may_find_field).
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/simulation/state_hash.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

constexpr std::size_t kNeedles = 16;

std::shared_ptr<const SimulationModel> model(const char* kernel = "elastic", std::size_t needles = kNeedles,
                                             const WorkCosts& costs = {}) {
  Scene scene;
  scene.needle.count = needles;
  scene.tissue.points = 2000;
  scene.model.kernel = kernel;
  scene.work_costs = costs;
  return load_simulation_model(scene, load_tissue(scene).tissue);
}

// All side by side, with their tips at depth z, stirred by `aside`, mm.
std::vector<NeedlePose> side_by_side(double z, double aside) {
  std::vector<NeedlePose> poses;
  for (std::size_t n = 0; n < kNeedles; ++n) {
    const double x = 8 * static_cast<double>(n % 4) - 12, y = 8 * static_cast<double>(n / 4) - 12;
    poses.push_back(test::needle_pose(test::pose_at({x + aside, y, z}, Vec3::UnitZ())));
  }
  return poses;
}

struct Session {
  explicit Session(std::shared_ptr<const SimulationModel> model)
      : simulator(std::move(model)), state(simulator.initial_state()) {}

  /// Whether the tissue moved.
  bool step(const std::vector<NeedlePose>& poses) {
    const std::vector<float> before = state.mesh.deformed_vertices;
    simulator.step(poses, state);
    hash.add(state);
    return state.mesh.deformed_vertices != before;
  }
  bool is_late() const { return (state.summary.step_flags & kStepLate) != 0; }
  Vec3 force() const { return state.needles.states[5].forces.force_n; }

  void insert() {
    for (double z = -45; z < 12; z += 0.5) step(side_by_side(z, 0));
  }
  std::vector<NeedlePose> stir(int k) const {
    return side_by_side(12 + std::sin(0.7 * k), 3 * std::sin(0.4 * k));
  }

  Simulator simulator;
  MeshState state;
  StateHash hash;
};

/// Of a machine on which their forces and their field do not fit into one tick.
WorkCosts dear() {
  return WorkCosts{}.slower_by(4);
}

TEST(ManyNeedles, HaveTheirForcesAndTheirFieldInEveryTick) {
  Session session(model());
  session.insert();
  for (int k = 0; k < 40; ++k) {
    const Vec3 before = session.force();
    EXPECT_TRUE(session.step(session.stir(k))) << k;
    EXPECT_NE(session.force(), before) << k;
    EXPECT_EQ(session.is_late(), session.state.summary.lag_mm > WorkBudget{}.lag_mm) << k;
  }
}

TEST(ManyNeedles, ForcesAndFieldTakeTurnsWhereATickHasNoTimeForBoth) {
  Session session(model("elastic", kNeedles, dear()));
  session.insert();
  int turns = 0;
  bool was_field_due = false;
  for (int k = 0; k < 100; ++k) {
    const Vec3 before = session.force();
    const bool moved = session.step(session.stir(k)), is_new_force = session.force() != before;
    EXPECT_TRUE(moved || is_new_force) << k;
    if (was_field_due) {
      EXPECT_TRUE(moved && !is_new_force) << k;
      EXPECT_TRUE(session.is_late());
    }
    was_field_due = !moved;
    if (was_field_due) {
      EXPECT_TRUE(session.is_late());
      EXPECT_GT(session.state.summary.lag_mm, 0) << "how far the landmarks have gone";
      ++turns;
    }
  }
  EXPECT_GE(turns, 40);
}

// Rounding of what their landmarks are carried by moves nothing.
TEST(ManyNeedles, AreOnTimeAgainOnceTheyRest) {
  for (const std::size_t needles : {1, 4, 12, 16}) {
    SCOPED_TRACE(needles);
    Session session(model("elastic", needles));
    session.insert();
    for (int k = 0; k < 40; ++k) session.step(session.stir(k));
    bool moved = true;
    for (int k = 0; k < 60; ++k) moved = session.step(session.stir(40));
    EXPECT_FALSE(session.is_late());
    EXPECT_FALSE(moved);
    for (double z = 12; z > -50; z -= 0.5) session.step(side_by_side(z, 0));
    for (int k = 0; k < 3; ++k) session.step(side_by_side(-50, 0));
    EXPECT_EQ(session.state.mesh.deformed_vertices, session.simulator.initial_state().mesh.deformed_vertices);
  }
}

TEST(ManyNeedles, AreTheSameBitForBitOnEveryRun) {
  const auto shared = model();
  std::array<std::uint64_t, 2> hashes{};
  for (std::uint64_t& hash : hashes) {
    Session session(shared);
    session.insert();
    for (int k = 0; k < 20; ++k) session.step(session.stir(k));
    hash = session.hash.value();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(ManyNeedles, DoWhatTheScenesCostsOfWorkAllowSoThatTheSameCostsGiveTheSameBits) {
  const auto hash_with = [](const WorkCosts& costs) {
    Session session(model("elastic", 4, costs));
    session.insert();
    for (int k = 0; k < 20; ++k) session.step(session.stir(k));
    return session.hash.value();
  };
  const std::uint64_t stored = hash_with({}), slow = hash_with(WorkCosts{}.slower_by(2));
  EXPECT_NE(slow, stored);
  EXPECT_EQ(hash_with(WorkCosts{}.slower_by(2)), slow);
}

TEST(ManyNeedles, ANeedleThatLeavesWhileTheFieldIsDueIsGone) {
  for (const int ticks : {20, 21}) {
    Session session(model("elastic", kNeedles, dear()));
    session.insert();
    for (int k = 0; k < ticks; ++k) session.step(session.stir(k));
    std::vector<NeedlePose> poses = session.stir(ticks);
    poses[5] = {};
    for (int k = 0; k < 2; ++k) session.step(poses);
    EXPECT_FALSE(session.state.needles.states[5].present);
    EXPECT_EQ(session.force(), Vec3(Vec3::Zero()));
    poses = session.stir(ticks);
    for (int k = 0; k < 2; ++k) session.step(poses);
    EXPECT_TRUE(session.state.needles.states[5].present);
    EXPECT_EQ(session.state.needles.states[5].X_WN.p, poses[5].X_WN.p);
  }
}

TEST(ManyNeedles, OfTheCheapModelsAreNeverLate) {
  Session session(model("psi31"));
  session.insert();
  for (int k = 0; k < 40; ++k) {
    session.step(session.stir(k));
    EXPECT_FALSE(session.is_late());
  }
}

TEST(ManyNeedles, TakeTurnsWithoutAllocating) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "a sanitizer owns malloc";
  for (const WorkCosts& costs : {WorkCosts{}, dear()}) {
    Session session(model("elastic", kNeedles, costs));
    session.insert();
    std::vector<std::vector<NeedlePose>> poses;
    for (int k = 0; k < 20; ++k) poses.push_back(session.stir(k));
    const std::uint64_t before = test::allocation_count();
    for (const auto& pose : poses) session.simulator.step(pose, session.state);
    EXPECT_EQ(test::allocation_count() - before, 0u);
  }
}

}  // namespace
}  // namespace brachy
