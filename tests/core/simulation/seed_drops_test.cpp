#include "core/simulation/seed_drops.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/core/simulation/tick_parts.h"

namespace brachy {
namespace {

using test::TickParts;

/// The parts of a tick with seeds: a magazine, without a plan.
struct Dropping : TickParts {
  static Scene few_seeds() {
    Scene scene = small_phantom();
    scene.seeds.max_count = 3;
    return scene;
  }
  Dropping() : TickParts(few_seeds()), mesh(model->tissue), seeds(*model) {}

  void step(const Vec3& tip, bool button = false) {
    NeedlePose pose = test::needle_pose(test::pose_at(tip, Vec3::UnitZ()));
    pose.button = button;
    mesh.begin(tick + 1);
    TickParts::step(std::span(&pose, 1));
    ASSERT_TRUE(is_solved);
    mesh.show(*field, body.frame());
    seeds.move(tick, *field, body.frame());
    instruments.find_shapes();
    seeds.drop(tick, instruments, {*field, body.frame(), mesh});
  }
  void press(const Vec3& tip) {
    step(tip, true);
    step(tip);
  }
  void insert(double depth_z) {
    for (double z = -40; z <= depth_z; z += 0.5) step({8, -4, z});
  }

  ShownMesh mesh;
  SeedDrops seeds;
};

TEST(SeedDrops, APressLeavesASeedAtTheTipThatSpringsBackWithTheTissue) {
  Dropping session;
  session.insert(5);
  session.press({8, -4, 5});
  ASSERT_EQ(session.seeds.in_tissue().size(), 1u);
  const Seed& seed = session.seeds.in_tissue()[0];
  EXPECT_LT((seed.dropped - Vec3(8, -4, 5)).norm(), 1);
  EXPECT_GT(seed.gland_motion.norm(), 1e-3) << "the needle pushes the gland when it falls";
  EXPECT_EQ(session.instruments.states()[0].drops.dropped, 1u);
  const Vec3 under_load = seed.position;
  for (double z = 5; z >= -60; z -= 0.5) session.step({8, -4, z});
  EXPECT_GT((session.seeds.in_tissue()[0].position - under_load).norm(), 0.05);
}

TEST(SeedDrops, BeyondTheScenesCountAndInFrontOfTheTemplateOneIsRefusedAndListed) {
  Dropping session;
  session.insert(5);
  for (double z = 5; z >= 0; z -= 1) session.press({8, -4, z});
  EXPECT_EQ(session.seeds.in_tissue().size(), 3u);
  EXPECT_EQ(session.instruments.states()[0].drops.refused, 3u);
  const double template_z = session.model->settings.template_grid.origin_mm.z();
  session.press({8, -4, template_z - 10});
  SeedStates seeds;
  seeds.slots.resize(3);
  seeds.ticks.resize(3);
  FailedDrops failed;
  session.seeds.write(0, seeds, failed);
  EXPECT_EQ(seeds.count, 3u);
  ASSERT_EQ(failed.count, 4u);
  EXPECT_EQ(failed.slots[0].why, DropRefusal::kFull);
  EXPECT_EQ(failed.slots[3].why, DropRefusal::kLost);
  EXPECT_EQ(session.instruments.states()[0].drops.last_refusal, DropRefusal::kLost);
}

TEST(SeedDrops, ASlotGetsOnlyWhatIsNewToIt) {
  Dropping session;
  session.insert(5);
  session.press({8, -4, 5});
  SeedStates seeds;
  seeds.slots.resize(3);
  seeds.ticks.resize(3);
  FailedDrops failed;
  session.seeds.write(0, seeds, failed);
  EXPECT_EQ(seeds.count, 1u);
  seeds.slots[0].position = {100, 0, 0};
  session.seeds.write(session.tick, seeds, failed);
  EXPECT_EQ(seeds.slots[0].position.x(), 100) << "it has not moved since";
}

TEST(SeedDrops, EarlierSeedsComeBackUnlessTheyAreTooMany) {
  Dropping session;
  std::vector<Seed> earlier(3);
  session.seeds.restore(earlier);
  EXPECT_EQ(session.seeds.in_tissue().size(), 3u);
  earlier.resize(4);
  Dropping another;
  EXPECT_THROW(another.seeds.restore(earlier), UserError);
}

}  // namespace
}  // namespace brachy
