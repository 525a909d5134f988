// Seeds in a whole simulation: dropped into deformed tissue, moved with it, and returned to rest.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>

#include "core/base/error.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

Scene small_scene(const std::string& model_name = "psi31") {
  Scene scene;
  scene.tissue.points = 2000;
  scene.model.kernel = model_name;
  scene.seeds.max_count = 64;
  return scene;
}

class DropSession {
 public:
  explicit DropSession(const Scene& scene)
      : simulator(load_simulation_model(scene, load_tissue(scene).tissue)) {}

  void step(const Vec3& tip, bool button = false, const Vec3& axis = Vec3::UnitZ()) {
    NeedlePose pose = needle_pose(pose_at(tip, axis));
    pose.button = button;
    simulator.step(pose, state);
  }
  void go(const Vec3& from, const Vec3& to, double stride, const Vec3& axis = Vec3::UnitZ()) {
    for (const Vec3& tip : test::straight(from, to, stride)) step(tip, false, axis);
  }
  const Seed& seed(std::size_t i) const { return state.seeds.in_tissue()[i]; }

  Simulator simulator;
  MeshState state = simulator.initial_state();
};

const Vec3 kUnderTemplate{8, -4, -40}, kDropDepth{8, -4, 8};

class SeedsOnModels : public ::testing::TestWithParam<std::string> {};

// The needle pushes the tissue ahead of itself and to the side by 5 mm, drops, and goes out again.
TEST_P(SeedsOnModels, DroppedAtADisplacedTipASeedComesHomeToItsMaterialPoint) {
  DropSession session(small_scene(GetParam()));
  session.go(kUnderTemplate, kDropDepth, 0.25);
  const Vec3 aside = kDropDepth + Vec3(4, 3, 0);
  session.go(kDropDepth, aside, 0.1);
  session.step(aside, true);
  ASSERT_EQ(session.state.seeds.count, 1u) << to_string(session.state.needles.states[0].drops.last_refusal);
  const Seed fallen = session.seed(0);
  EXPECT_EQ(fallen.dropped, aside);
  EXPECT_LT((fallen.position - aside).norm(), 1e-6);
  EXPECT_GT((fallen.rest - aside).norm(), 3);  // it was displaced
  EXPECT_NEAR(fallen.axis.z(), 1, 1e-3);

  session.go(aside, kDropDepth, 0.1);
  session.go(kDropDepth, kUnderTemplate, 0.25);
  ASSERT_EQ(session.state.summary.moved_vertices, 0u);
  EXPECT_EQ(session.seed(0).position, fallen.rest);
  EXPECT_EQ(session.seed(0).axis, fallen.rest_axis);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SeedsOnModels,
                         ::testing::Values("psi30", "psi31", "psi32", "buhmann", "elastic"),
                         [](const auto& test) { return test.param; });

// The material point at the tip is known without inversion: it is as far along the straight cut as the needle has cut,
// also when pushed aside by 5 mm.
TEST(Seeds, BelongToTheTissueThatTheTipHasCutTo) {
  DropSession session(small_scene());
  const SurfaceBvh surface(load_surface(small_scene()).mesh);
  const double entry_z = surface.first_hit(kUnderTemplate, kDropDepth)->point.z();
  session.go(kUnderTemplate, kDropDepth, 0.25);
  const Vec3 aside = kDropDepth + Vec3(4, 3, 0);
  session.go(kDropDepth, aside, 0.1);
  session.step(aside, true);
  ASSERT_EQ(session.state.seeds.count, 1u);
  const Vec3 under_tip(kDropDepth.x(), kDropDepth.y(),
                       entry_z + session.state.needles.states[0].insertion_depth_mm);
  ASSERT_GT((under_tip - aside).norm(), 5);
  EXPECT_LT((session.seed(0).rest - under_tip).norm(), 0.05);
}

// Beside a point of the mesh that is next to the tip.
TEST(Seeds, LandWithinAFewMicrometresOfTheTissueTheyFellInto) {
  DropSession session(small_scene());
  session.go(kUnderTemplate, kDropDepth, 0.25);
  // Tissue points near the tip, where they are now.
  const Tissue& tissue = session.simulator.tissue();
  const auto now = [&](std::size_t i) {
    const float* x = &session.state.mesh.deformed_vertices[3 * i];
    return Vec3(x[0], x[1], x[2]);
  };
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < tissue.size(); ++i)
    if ((now(i) - kDropDepth).norm() < (now(nearest) - kDropDepth).norm()) nearest = i;
  ASSERT_LT((now(nearest) - kDropDepth).norm(), 3);
  session.step(kDropDepth, true);
  ASSERT_EQ(session.state.seeds.count, 1u);
  // Neighbours at the tip are neighbours at rest: the offset is stretched by F at most.
  const Vec3 offset = now(nearest) - kDropDepth,
             rest_offset = tissue.rest_vertices[nearest] - session.seed(0).rest;
  EXPECT_LT(rest_offset.norm(), 3 * offset.norm() + 0.05);
}

TEST(Seeds, OutsideTheTissueASeedStaysWhereTheTipWasWhateverTheTissueDoes) {
  DropSession session(small_scene());
  session.step(kUnderTemplate);
  session.step(kUnderTemplate, true);
  ASSERT_EQ(session.state.seeds.count, 1u);
  EXPECT_EQ(session.state.needles.states[0].drops.dropped, 1u);
  const Seed fallen = session.seed(0);
  EXPECT_TRUE(fallen.is_fixed);
  EXPECT_FALSE(fallen.is_certified);
  EXPECT_EQ(fallen.dropped, kUnderTemplate);
  EXPECT_EQ(fallen.rest, kUnderTemplate);
  session.go(kUnderTemplate, kDropDepth, 0.25);
  EXPECT_EQ(session.seed(0), fallen);
}

TEST(Seeds, BeyondTheFarSideASeedStaysWhereTheTipWas) {
  DropSession session(small_scene());
  const Vec3 beyond{8, -4, 40};
  session.go(kUnderTemplate, beyond, 0.25);
  ASSERT_EQ(session.state.needles.states[0].contact, ContactState::kThrough);
  session.step(beyond, true);
  ASSERT_EQ(session.state.seeds.count, 1u) << to_string(session.state.needles.states[0].drops.last_refusal);
  EXPECT_TRUE(session.seed(0).is_fixed);
  EXPECT_EQ(session.seed(0).rest, beyond);
  session.step(beyond, false);
  session.go(beyond, kDropDepth, 0.25);
  session.step(kDropDepth, true);
  ASSERT_EQ(session.state.seeds.count, 2u);
  EXPECT_FALSE(session.seed(1).is_fixed);
  session.go(kDropDepth, kUnderTemplate, 0.25);
  EXPECT_EQ(session.seed(0).position, beyond);
  EXPECT_EQ(session.seed(1).position, session.seed(1).rest);
}

TEST(Seeds, OutsideTheBodyASeedIsLostAndItsNeedleLacksIt) {
  DropSession session(small_scene());
  const Vec3 in_front{8, -4, small_scene().template_grid.origin_mm.z() - 1};
  session.step(in_front);
  session.step(in_front, true);
  EXPECT_EQ(session.state.seeds.count, 0u);
  EXPECT_EQ(session.state.needles.states[0].drops.dropped, 0u);
  EXPECT_EQ(session.state.needles.states[0].drops.refused, 1u);
  EXPECT_EQ(session.state.needles.states[0].drops.last_refusal, DropRefusal::kLost);
}

TEST(Seeds, AreAtMostAsManyAsTheSceneSays) {
  Scene scene = small_scene();
  scene.seeds.max_count = 2;
  DropSession session(scene);
  session.go(kUnderTemplate, kDropDepth, 0.25);
  for (int i = 0; i < 4; ++i) {
    session.step(kDropDepth - Vec3(0, 0, i), true);
    session.step(kDropDepth - Vec3(0, 0, i), false);
  }
  EXPECT_EQ(session.state.seeds.count, 2u);
  EXPECT_EQ(session.state.needles.states[0].drops.refused, 2u);
  EXPECT_EQ(session.state.needles.states[0].drops.last_refusal, DropRefusal::kFull);
}

// Slots of a triple buffer lag: whichever ticks they miss, they have all seeds at their present positions.
TEST(Seeds, StatesThatSkipTicksHoldThemAll) {
  DropSession session(small_scene());
  MeshState lagging = session.simulator.initial_state();
  std::mt19937 random(3);
  const auto poses = test::insertion();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    NeedlePose pose = needle_pose(poses[k]);
    pose.button = k % 40 < 3;
    const bool lags = random() % 4 != 0;
    session.simulator.step(pose, lags ? session.state : lagging);
    if (!lags) {
      MeshState fresh = session.simulator.initial_state();
      session.simulator.step(pose, fresh);
      ASSERT_EQ(fresh.seeds.count, lagging.seeds.count);
    }
  }
  session.simulator.step(needle_pose(poses.back()), lagging);
  session.simulator.step(needle_pose(poses.back()), session.state);
  EXPECT_GT(lagging.seeds.count, 3u);
  EXPECT_TRUE(std::ranges::equal(lagging.seeds.in_tissue(), session.state.seeds.in_tissue()));
}

TEST(Seeds, OfAnEarlierRunAreInTheTissueAndMoveWithIt) {
  DropSession first(small_scene());
  first.go(kUnderTemplate, kDropDepth, 0.25);
  first.step(kDropDepth, true);
  first.go(kDropDepth, kUnderTemplate, 0.25);
  ASSERT_EQ(first.state.seeds.count, 1u);

  const Scene scene = small_scene();
  Simulator simulator(load_simulation_model(scene, load_tissue(scene).tissue));
  simulator.restore_seeds(first.state.seeds.in_tissue());
  MeshState state = simulator.initial_state();
  ASSERT_EQ(state.seeds.count, 1u);
  EXPECT_EQ(state.seeds.in_tissue()[0].position, first.seed(0).rest);
  for (const Vec3& tip : test::straight(kUnderTemplate, kDropDepth, 0.25))
    simulator.step(needle_pose(pose_at(tip, Vec3::UnitZ())), state);
  EXPECT_NE(state.seeds.in_tissue()[0].position, first.seed(0).rest);
  NeedlePose pose = needle_pose(pose_at(kDropDepth - Vec3(0, 0, 1), Vec3::UnitZ()));
  pose.button = true;
  simulator.step(pose, state);
  EXPECT_EQ(state.seeds.count, 2u);
  EXPECT_EQ(state.seeds.in_tissue()[1].id, 2u);
  Scene tight = scene;
  tight.seeds.max_count = 1;
  Simulator too_small(load_simulation_model(tight, load_tissue(tight).tissue));
  EXPECT_THROW(too_small.restore_seeds(state.seeds.in_tissue()), UserError);
}

// Another model during an insertion: time and seeds continue, the tissue is at rest and the needle is reinserted.
TEST(Seeds, GoOnWithAnotherModel) {
  DropSession first(small_scene());
  first.go(kUnderTemplate, kDropDepth, 0.25);
  first.step(kDropDepth, true);
  first.step(kDropDepth + Vec3(2, 0, 0));
  ASSERT_EQ(first.state.seeds.count, 1u);
  ASSERT_NE(first.seed(0).position, first.seed(0).rest);
  for (const char* model_name : {"psi32", "elastic", "compact_elastic"}) {
    DropSession next(small_scene(model_name));
    const std::uint64_t before = test::allocation_count();
    next.simulator.resume_from(first.simulator);
    next.step(kDropDepth);
    EXPECT_EQ(test::allocation_count(), before) << model_name;
    EXPECT_EQ(next.state.summary.tick, first.state.summary.tick + 1);
    EXPECT_EQ(next.state.needles.states[0].contact, ContactState::kInserted);
    ASSERT_EQ(next.state.seeds.count, 1u);
    EXPECT_EQ(next.seed(0).position, next.seed(0).rest) << model_name;
    EXPECT_EQ(next.seed(0).rest, first.seed(0).rest);
    EXPECT_EQ(next.state.summary.moved_vertices, 0u) << model_name;
    EXPECT_EQ(next.state.needles.states[0].drops.dropped, 1u);
    next.go(kDropDepth, kUnderTemplate, 0.25);
    EXPECT_EQ(next.state.mesh.deformed_vertices, next.simulator.initial_state().mesh.deformed_vertices)
        << model_name;
  }
}

TEST(Seeds, FallAndMoveWithoutAllocating) {
  DropSession session(small_scene());
  session.go(kUnderTemplate, kDropDepth, 0.25);
  const std::uint64_t before = test::allocation_count();
  for (int i = 0; i < 20; ++i) session.step(kDropDepth - Vec3(0, 0, 0.5 * i), i % 2 == 0);
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_EQ(session.state.seeds.count, 10u);
}

// 10,000 random seeds, where the field is smooth and where it is close to folding: accepted ones are at a material
// point of the tip, those that are not unique are marked, and those in a fold are refused.
TEST(Seeds, RandomDropsAreRightOrRefused) {
  const int wanted = test::kIsSanitized ? 200 : 10'000;
  int dropped = 0, refused = 0;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int run = 0; dropped + refused < wanted; ++run) {
    Scene scene =
        small_scene(std::array{"psi31", "psi30", "psi32", "buhmann"}[static_cast<std::size_t>(run) % 4]);
    scene.tissue.points = 1300;
    scene.stability.policy = std::array{"substep", "clamp", "flag"}[static_cast<std::size_t>(run) % 3];
    scene.seeds.max_count = 4096;
    DropSession session(scene);
    const Vec3 axis = Vec3(0.3 * unit(random), 0.3 * unit(random), 1).normalized();
    const Vec3 target(14 * unit(random), 8 * unit(random), 10 * unit(random));
    session.go(target - 60 * axis, target, 0.5, axis);
    Vec3 tip = target;
    for (int i = 0; i < 250 && dropped + refused < wanted; ++i) {
      tip += 1.2 * Vec3(unit(random), unit(random), unit(random));
      if ((tip - target).norm() > 12) tip = target;
      const std::uint32_t before = session.state.seeds.count;
      session.step(tip, true, axis);
      const ContactState contact = session.state.needles.states[0].contact;
      const bool is_in = contact == ContactState::kInserted || contact == ContactState::kThrough;
      if (session.state.seeds.count == before) {
        ++refused;
        ASSERT_TRUE(is_in);  // outside the tissue every one falls
        if (session.state.summary.certificate.verdict == Verdict::kInjective)
          ADD_FAILURE() << "refused in a certified field: "
                        << to_string(session.state.needles.states[0].drops.last_refusal);
      } else {
        const Seed& seed = session.state.seeds.in_tissue().back();
        ++dropped;
        ASSERT_TRUE(seed.is_fixed || session.simulator.model()->surface.inside(seed.rest));
        if (session.state.summary.certificate.verdict != Verdict::kInjective) {
          ASSERT_FALSE(seed.is_certified);
        }
        ASSERT_LT((seed.position - tip).norm(), 1e-6);
        ASSERT_LT((seed.rest - tip).norm(), 16);
      }
      session.step(tip, false, axis);
    }
  }
  EXPECT_GT(dropped, wanted / 2);
  std::cout << dropped << " dropped, " << refused << " refused\n";
}

// One in the gland and one in front of it are there before a needle comes.
TEST(SeedsAtStart, MoveWithTheTissueAndOthersAreAddedToThem) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "at_start.csv";
  std::ofstream(file) << "x,y,z,ax,ay,az,source,strength_u\n8,-4,6,0,0,1,200,1.5\n0,0,-45,0,0,1,200,1.5\n";
  Scene scene = small_scene();
  scene.implant.seeds = file.string();
  DropSession session(scene);
  ASSERT_EQ(session.state.seeds.count, 2u);
  EXPECT_TRUE(session.seed(0).was_there());
  EXPECT_FALSE(session.seed(0).is_fixed);
  EXPECT_TRUE(session.seed(1).is_fixed);
  session.go(kUnderTemplate, kDropDepth, 0.25);
  EXPECT_GT((session.seed(0).position - Vec3(8, -4, 6)).norm(), 0.5);
  EXPECT_EQ(session.seed(1).position, Vec3(0, 0, -45));
  session.step(kDropDepth, true);
  ASSERT_EQ(session.state.seeds.count, 3u);
  EXPECT_EQ(session.seed(2).id, 3u);
  EXPECT_EQ(session.seed(2).needle, 0);
  session.go(kDropDepth, kUnderTemplate, 0.25);
  EXPECT_EQ(session.seed(0).position, Vec3(8, -4, 6));
  scene.seeds.max_count = 1;
  EXPECT_THROW(DropSession{scene}, UserError);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace brachy
