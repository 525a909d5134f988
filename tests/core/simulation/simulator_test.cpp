#include "core/simulation/simulator.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/simulation/state_hash.h"
#include "core/solve/factor_status.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

using test::insertion;
using test::needle_pose;

// The default scene with the cheapest model, whose reach is bounded.
Scene default_scene() {
  Scene scene;
  scene.model.kernel = "psi31";
  return scene;
}

Tissue phantom(const Scene& scene) {
  static const Tissue tissue = load_tissue(scene).tissue;
  return tissue;
}

TEST(Simulator, TheDefaultSceneHasThePapersPoints) {
  const Simulator simulator(load_simulation_model(default_scene(), phantom({})));
  EXPECT_EQ(simulator.tissue().size(), 14560u);
  EXPECT_EQ(simulator.tissue().surface_count, 1200u);
}

TEST(Simulator, WithoutANeedleNothingMoves) {
  Simulator simulator(load_simulation_model(default_scene(), phantom({})));
  MeshState state = simulator.initial_state();
  const std::vector<float> rest = state.mesh.deformed_vertices;
  simulator.step(NeedlePose{}, state);
  EXPECT_EQ(state.summary.tick, 1u);
  EXPECT_EQ(state.mesh.deformed_vertices, rest);
  EXPECT_EQ(state.summary.moved_vertices, 0u);
  EXPECT_FALSE(state.needles.states[0].present);
}

TEST(Simulator, ReturnsBitwiseToRestAfterWithdrawal) {
  Scene scene = default_scene();
  scene.anchors.lambda_loaded = 0.3;  // dynamic anchors, within reach
  scene.model.support_radius_mm = 25;
  Simulator simulator(load_simulation_model(scene, phantom(scene)));
  MeshState state = simulator.initial_state();
  const std::vector<float> rest = state.mesh.deformed_vertices;
  double largest = 0;
  for (const RigidTransform& X_WN : insertion()) {
    simulator.step(needle_pose(X_WN), state);
    largest = std::max(largest, state.summary.max_displacement_mm);
    ASSERT_EQ(state.summary.step_flags & ~(kStepUncertified | kStepSubstepped),
              0u);  // weights are large at a = 25 mm
  }
  EXPECT_GT(largest, 2);
  EXPECT_EQ(state.needles.states[0].contact, ContactState::kWithdrawn);
  EXPECT_EQ(state.mesh.deformed_vertices, rest);
  EXPECT_EQ(state.summary.max_displacement_mm, 0);
  EXPECT_EQ(state.summary.moved_vertices, 0u);
}

TEST(Simulator, VerticesOutsideEverySupportNeverChange) {
  Scene scene = default_scene();
  scene.anchors.count = 0;
  scene.stability.policy = "flag";  // where sub-steps are composed, supports go along with the landmarks
  Simulator simulator(load_simulation_model(scene, phantom(scene)));
  MeshState state = simulator.initial_state();
  const std::vector<float> rest = state.mesh.deformed_vertices;
  std::size_t out_of_reach = 0, moved = 0;
  double top = -40;  // of the needle so far: what it carries springs no higher
  for (const RigidTransform& X_WN : insertion()) {
    simulator.step(needle_pose(X_WN), state);
    out_of_reach = 0;
    top = std::max(top, X_WN.p.z());
    for (std::size_t i = 0; i < simulator.tissue().size(); ++i) {
      // Every landmark lies on the line x = 8, y = -4 at rest, from the capsule to the tip.
      const Vec3& X = simulator.tissue().rest_vertices[i];
      const bool same = std::equal(&rest[3 * i], &rest[3 * i] + 3, &state.mesh.deformed_vertices[3 * i]);
      const double above = std::max(0.0, X.z() - top);
      const double distance = std::hypot(X.x() - 8, X.y() + 4, above);
      if (distance >= scene.model.support_radius_mm) {
        ++out_of_reach;
        ASSERT_TRUE(same) << i;
      }
      moved += !same;
    }
  }
  EXPECT_GT(out_of_reach, 1000u);
  EXPECT_GT(moved, 1000u);
}

TEST(Simulator, LandmarksAtTheTipAreReproducedInTheMesh) {
  // The vertex nearest to the needle's tip on the capsule goes along with it.
  Simulator simulator(load_simulation_model(default_scene(), phantom({})));
  MeshState state = simulator.initial_state();
  const auto poses = insertion();
  for (const RigidTransform& X_WN : poses) {
    simulator.step(needle_pose(X_WN), state);
    if (state.needles.states[0].contact == ContactState::kTouching && state.summary.max_displacement_mm > 2.5)
      break;
  }
  ASSERT_EQ(state.needles.states[0].contact, ContactState::kTouching);
  EXPECT_GT(state.summary.max_displacement_mm, 2.3);
  EXPECT_LE(state.summary.max_displacement_mm, 3.0);
}

// A slot may be any number of publishes behind; after a step it holds this tick all the same, and block_ticks tell a
// reader that skipped any number of snapshots exactly what it lacks.
TEST(Simulator, EverySlotAndEverySkippingReaderGetsEveryChange) {
  Simulator one(load_simulation_model(default_scene(), phantom({}))),
      many(load_simulation_model(default_scene(), phantom({})));
  MeshState reference = one.initial_state();
  std::vector<MeshState> slots(3, many.initial_state());
  MeshState reader = many.initial_state();
  std::mt19937_64 random(7);
  std::size_t blocks_sent = 0, blocks = 0;
  for (const RigidTransform& X_WN : insertion()) {
    one.step(needle_pose(X_WN), reference);
    MeshState& slot = slots[random() % 3];
    many.step(needle_pose(X_WN), slot);
    ASSERT_EQ(slot.mesh.deformed_vertices, reference.mesh.deformed_vertices);
    ASSERT_EQ(slot.mesh.block_ticks, reference.mesh.block_ticks);
    if (random() % 7 != 0) continue;
    for (std::size_t b = 0; b < many.tissue().blocks.size(); ++b) {
      ++blocks;
      if (slot.mesh.block_ticks[b] <= reader.summary.tick) continue;
      ++blocks_sent;
      const Block& block = many.tissue().blocks[b];
      std::copy_n(&slot.mesh.deformed_vertices[3 * block.first], 3 * block.count,
                  &reader.mesh.deformed_vertices[3 * block.first]);
    }
    reader.summary.tick = slot.summary.tick;
    ASSERT_EQ(reader.mesh.deformed_vertices, slot.mesh.deformed_vertices);
  }
  EXPECT_LT(blocks_sent, blocks / 2);  // it was not simply everything
}

TEST(Simulator, PoseHistoryHoldsEveryPoseOfTheLastTicks) {
  Simulator simulator(load_simulation_model(default_scene(), phantom({})));
  std::vector<MeshState> slots(2, simulator.initial_state());
  const auto poses = insertion();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    MeshState& slot = slots[i % 5 == 0];
    simulator.step(needle_pose(poses[i]), slot);
    for (std::size_t back = 0; back < NeedleStates::kPoseHistory && back <= i; ++back) {
      const TickPose& entry = slot.needles.pose_histories[0][(i + 1 - back) % NeedleStates::kPoseHistory];
      ASSERT_EQ(entry.tick, i + 1 - back);
      ASSERT_EQ(entry.X_WN, poses[i - back]);
    }
  }
}

std::uint64_t run_hash(const Scene& scene, std::size_t ticks) {
  Simulator simulator(load_simulation_model(scene, phantom(scene)));
  MeshState state = simulator.initial_state();
  StateHash hash;
  const auto poses = insertion();
  for (std::size_t i = 0; i < ticks; ++i) {
    simulator.step(needle_pose(poses[i]), state);
    hash.add(state);
  }
  EXPECT_NE(state.needles.states[0].contact, ContactState::kFree);
  return hash.value();
}

TEST(Simulator, IsTheSameBitForBitOnEveryRunAndForAnyNumberOfThreads) {
  Scene scene = default_scene();
  const std::size_t all = insertion().size(), some = 200;  // a tick on two threads may cost a scheduler slice
  const std::uint64_t whole = run_hash(scene, all), part = run_hash(scene, some);
  EXPECT_EQ(run_hash(scene, all), whole);
  scene.engine.threads = 2;
  EXPECT_EQ(run_hash(scene, some), part);
  scene.model.support_radius_mm = 11.999;
  EXPECT_NE(run_hash(scene, some), part);
}

TEST(Simulator, TicksDoNotAllocate) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "a sanitizer owns malloc";
  for (const char* kernel : {"psi31", "buhmann"}) {
    Scene scene = default_scene();
    scene.model.kernel = kernel;
    Simulator simulator(load_simulation_model(scene, phantom(scene)));
    MeshState state = simulator.initial_state();
    const auto poses = insertion();
    const std::uint64_t before = test::allocation_count();
    for (const RigidTransform& X_WN : poses) simulator.step(needle_pose(X_WN), state);
    EXPECT_EQ(test::allocation_count() - before, 0u);
  }
}

struct StepFlags {
  std::uint32_t last = 0, any = 0;  // of the last tick, and of all together
};

/// Takes a needle in and out again: nothing is allocated, and the mesh returns to rest bit for bit.
StepFlags insert_and_withdraw(const Scene& scene) {
  Simulator simulator(load_simulation_model(scene, phantom(scene)));
  MeshState state = simulator.initial_state();
  const std::vector<float> rest = state.mesh.deformed_vertices;
  double largest = 0;
  StepFlags flags;
  const auto poses = insertion();
  const std::uint64_t before = test::allocation_count();
  for (const RigidTransform& X_WN : poses) {
    simulator.step(needle_pose(X_WN), state);
    largest = std::max(largest, state.summary.max_displacement_mm);
    flags.any |= state.summary.step_flags;
  }
  if (test::allocations_are_counted()) {
    EXPECT_EQ(test::allocation_count() - before, 0u);
  }
  EXPECT_GT(largest, 1);
  EXPECT_EQ(state.needles.states[0].contact, ContactState::kWithdrawn);
  EXPECT_EQ(state.mesh.deformed_vertices, rest);
  flags.last = state.summary.step_flags;
  return flags;
}

class MatrixModels : public testing::TestWithParam<const char*> {};

TEST_P(MatrixModels, InsertAndReturnToRestWithoutAllocating) {
  Scene scene = default_scene();
  scene.model.kernel = GetParam();
  EXPECT_EQ(insert_and_withdraw(scene).last, 0u);
}

std::vector<const char*> matrix_models() {
  std::vector<const char*> models = {"compact_elastic", "elastic"};
  if (!test::kIsSanitized) models.push_back("fem");
  return models;
}

INSTANTIATE_TEST_SUITE_P(Simulator, MatrixModels, testing::ValuesIn(matrix_models()),
                         [](const auto& model_name) { return std::string(model_name.param); });

class ModelsWithRegions : public testing::TestWithParam<const char*> {};

TEST_P(ModelsWithRegions, InsertAndReturnToRestWithoutAllocating) {
  Scene scene = default_scene();
  scene.model.kernel = GetParam();
  const std::uint64_t homogeneous = run_hash(scene, 200);
  scene.regions.resize(2);
  scene.regions[0].centre_mm = Vec3(4, 0, 0);
  scene.regions[0].semi_axes_mm = Vec3(18, 14, 16);
  scene.regions[0].support_radius_mm = 24;
  scene.regions[1].centre_mm = Vec3(9, -4, 4);
  scene.regions[1].semi_axes_mm = Vec3::Constant(6);
  scene.regions[1].support_radius_mm = 7;
  EXPECT_NE(run_hash(scene, 200), homogeneous);
  EXPECT_EQ(insert_and_withdraw(scene).any & ~(kStepUncertified | kStepClamped), 0u);
}

INSTANTIATE_TEST_SUITE_P(Simulator, ModelsWithRegions, testing::Values("psi31", "compact_elastic"),
                         [](const auto& model_name) { return std::string(model_name.param); });

bool is_finite(const MeshState& state) {
  return std::ranges::all_of(state.mesh.deformed_vertices, [](float x) { return std::isfinite(x); });
}

TEST(Simulator, AnchorsThatCrowdAreLeftOutUntilTheRestCanBeSolved) {
  Scene scene = default_scene();
  scene.model.kernel = "psi32";
  scene.model.support_radius_mm = 500;  // with anchors 0.1 mm apart: singular to rounding
  scene.anchors.count = 64;
  scene.anchors.lambda_rest = scene.anchors.lambda_loaded = 0.01;
  Simulator simulator(load_simulation_model(scene, phantom(scene)));
  MeshState state = simulator.initial_state();
  const std::vector<float> rest = state.mesh.deformed_vertices;
  std::uint64_t allocated = 0, in_contact = 0;
  for (const RigidTransform& X_WN : insertion()) {
    const std::uint64_t before = test::allocation_count();
    simulator.step(needle_pose(X_WN), state);
    allocated += test::allocation_count() - before;
    if (state.summary.landmark_count == 0) continue;
    ++in_contact;
    ASSERT_EQ(state.summary.step_flags & ~(kStepUncertified | kStepFolded | kStepSubstepped | kStepClamped),
              kStepDropped);
    ASSERT_LT(state.summary.landmark_count, 64u);
    ASSERT_LE(state.summary.certificate.condition, FactorStatus::kMaxCondition);
    ASSERT_TRUE(is_finite(state));
  }
  EXPECT_GT(in_contact, 100u);
  EXPECT_EQ(allocated, 0u);
  EXPECT_EQ(state.needles.states[0].contact, ContactState::kWithdrawn);
  EXPECT_EQ(state.mesh.deformed_vertices, rest);
  EXPECT_EQ(state.summary.certificate.condition, 1);
}

// The needle is found standing in the tissue with its tip exactly on an anchor, then pushes: first both say 0, then the
// anchor contradicts the tip.
TEST(Simulator, AnAnchorAtTheTipsOwnPlaceGivesWay) {
  Scene scene = default_scene();
  scene.anchors.clearance_mm = 0;
  const Tissue tissue = phantom(scene);
  const Anchors anchors({tissue.rest_vertices.data(), tissue.surface_count}, scene.anchors);
  const Vec3 at = anchors.positions()[6];  // no other lies near the needle's way there
  Simulator simulator(load_simulation_model(scene, tissue));
  MeshState state = simulator.initial_state();
  std::uint64_t allocated = 0;
  std::uint32_t all = 0;
  for (const double push : {0.0, 0.3, 0.6, 0.6, 1.0}) {
    const NeedlePose pose = needle_pose(test::pose_at(at + Vec3(0, 0, push), Vec3::UnitZ()));
    const std::uint64_t before = test::allocation_count();
    simulator.step(pose, state);
    allocated += test::allocation_count() - before;
    EXPECT_EQ(state.summary.step_flags, push > 0 ? kStepDropped : kStepMerged) << push;
    EXPECT_TRUE(is_finite(state));
    EXPECT_NEAR(state.summary.max_displacement_mm, push, 0.3 * push);
    EXPECT_LT(state.summary.certificate.condition, 100);
    if (push == 0) all = state.summary.landmark_count;
    EXPECT_EQ(state.summary.landmark_count, all) << push;
  }
  EXPECT_EQ(allocated, 0u);
  EXPECT_GT(state.summary.max_displacement_mm, 0.7);
  EXPECT_GT(state.needles.states[0].forces.axial_n, 0.5);  // it is felt
}

TEST(Simulator, SaysHowWellConditionedTheTickIs) {
  Scene scene = default_scene();
  scene.model.support_radius_mm = 25;
  Simulator simulator(load_simulation_model(scene, phantom(scene)));
  MeshState state = simulator.initial_state();
  double largest = 0;
  for (const RigidTransform& X_WN : insertion()) {
    simulator.step(needle_pose(X_WN), state);
    if (state.summary.landmark_count == 0) {
      ASSERT_EQ(state.summary.certificate.condition, 1);
    } else {
      ASSERT_GE(state.summary.certificate.condition, 1);
    }
    largest = std::max(largest, state.summary.certificate.condition);
  }
  EXPECT_GT(largest, 100);  // the tip 1.25 mm from a landmark of the shaft
  EXPECT_LT(largest, 1e6);
}

TEST(Simulator, MoreAnchorsThanVerticesAreRefused) {
  Scene scene = default_scene();
  scene.anchors.count = 1201;
  EXPECT_THROW(load_simulation_model(scene, phantom(scene)), UserError);
}

}  // namespace
}  // namespace brachy
