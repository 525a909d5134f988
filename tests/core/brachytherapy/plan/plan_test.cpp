#include "core/brachytherapy/plan/plan.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace brachy {
namespace {

TEST(Plan, ATrainPlacesItsSeedsFromTheTipBackwards) {
  const PlanNeedle needle{"D4", 0, "s-s--s"};
  EXPECT_EQ(needle.seed_offsets_mm(), (std::vector<double>{2.25, 12.25, 27.75}));
  EXPECT_EQ(needle.train_length_mm(), 30);
  EXPECT_EQ((PlanNeedle{"D4", 0, "-ss"}).seed_offsets_mm(), (std::vector<double>{7.75, 12.25}));
}

TEST(Plan, SeedsLieBehindTheirNeedlesTipInOrder) {
  Plan plan;
  plan.source = SourceModel::kTheraSeed200;
  plan.air_kerma_strength_u = 2;
  plan.base_plane_mm = 80;
  plan.needles = {{"D4", 5, "s-s"}, {"G7", 0, "-s"}};
  const TemplateGrid grid;
  EXPECT_EQ(plan.planned_tip(grid, 0), Vec3(-15, -15, 15));
  const auto seeds = plan.seeds(grid);
  ASSERT_EQ(seeds.size(), 3u);
  EXPECT_EQ(plan.seed_count(), 3u);
  EXPECT_EQ(seeds[0].position, Vec3(-15, -15, 12.75));
  EXPECT_EQ(seeds[1].position, Vec3(-15, -15, 2.75));
  EXPECT_EQ(seeds[2].position, Vec3(0, 0, 12.25));
  EXPECT_EQ(seeds[1].needle, 0u);
  EXPECT_EQ(seeds[2].needle, 1u);
  EXPECT_EQ(seeds[1].offset_mm, 12.25);
  for (const PlannedSeed& s : seeds) {
    EXPECT_EQ(s.axis, Vec3::UnitZ());
    EXPECT_EQ(s.source, SourceModel::kTheraSeed200);
    EXPECT_EQ(s.air_kerma_strength_u, 2);
  }
}

TEST(Plan, AHoleBesideTheTemplateIsRefused) {
  Plan plan;
  plan.needles = {{"Z1", 0, "s"}};
  EXPECT_THROW(plan.seeds({}), UserError);
}

}  // namespace
}  // namespace brachy
