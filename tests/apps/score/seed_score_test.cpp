#include "apps/score/seed_score.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/apps/score/score_fixtures.h"

namespace brachy {
namespace {

using namespace test;

TEST(SeedScore, ErrorsAreSplitAlongAndAcrossThePlannedNeedle) {
  const SeedsScore score = score_seeds(kPlan, kGrid, small_seeds());
  ASSERT_EQ(score.planned.size(), 3u);
  const SeedScore& first = score.planned[0];
  EXPECT_EQ(first.hole, "D4");
  EXPECT_EQ(first.planned.offset_mm, 2.25);
  EXPECT_NEAR(first.dropped.total_mm, 1.3, 1e-12);
  EXPECT_NEAR(first.dropped.axial_mm, -1.2, 1e-12);
  EXPECT_NEAR(first.dropped.lateral_mm, 0.5, 1e-12);
  EXPECT_NEAR(first.rest.axial_mm, 3, 1e-12);
  EXPECT_NEAR(first.rest.lateral_mm, 0, 1e-12);
  EXPECT_NEAR(score.planned[1].rest.total_mm, 5, 1e-12);
  EXPECT_NEAR(score.planned[1].rest.lateral_mm, 4, 1e-12);
  EXPECT_EQ(score.planned[2].rest.total_mm, 0);
  EXPECT_EQ(score.planned[2].hole, "F6");
}

TEST(SeedScore, AlongIsAlongTheNeedleHoweverItLies) {
  PlannedSeed planned;
  planned.position = Vec3(1, 2, 3);
  planned.axis = Vec3(0.6, 0, 0.8);
  const Misplacement m = misplacement(planned, Vec3(1, 2, 3) + 5 * planned.axis + 2 * Vec3(-0.8, 0, 0.6));
  EXPECT_NEAR(m.axial_mm, 5, 1e-12);
  EXPECT_NEAR(m.lateral_mm, 2, 1e-12);
  EXPECT_NEAR(m.total_mm, std::sqrt(29.0), 1e-12);
}

TEST(SeedScore, MeansAreOfTheirSizesAndTheSignIsKeptApart) {
  const SeedsScore score = score_seeds(kPlan, kGrid, small_seeds());
  // At rest 3, 5 and 0 mm, of which along +3, −3, 0 and across 0, 4, 0.
  EXPECT_EQ(score.rest.total_mm.count, 3u);
  EXPECT_NEAR(score.rest.total_mm.mean, 8.0 / 3, 1e-12);
  EXPECT_NEAR(score.rest.total_mm.sd, std::sqrt((1.0 / 9 + 49.0 / 9 + 64.0 / 9) / 2), 1e-12);
  EXPECT_NEAR(score.rest.total_mm.max, 5, 1e-12);
  EXPECT_NEAR(score.rest.axial_mm.mean, 2, 1e-12);
  EXPECT_NEAR(score.rest.axial_mm.max, 3, 1e-12);
  EXPECT_NEAR(score.rest.lateral_mm.mean, 4.0 / 3, 1e-12);
  EXPECT_NEAR(score.rest.mean_signed_axial_mm, 0, 1e-12);
  EXPECT_NEAR(score.rest.axial_share, 0.75, 1e-12);
  EXPECT_NEAR(score.dropped.total_mm.mean, 1.3 / 3, 1e-12);
  EXPECT_NEAR(score.dropped.mean_signed_axial_mm, -0.4, 1e-12);
  EXPECT_NEAR(score.gland_motion_mm.mean, 4, 1e-12);
  EXPECT_NEAR(score.gland_motion_mm.sd, 2, 1e-12);
  EXPECT_NEAR(score.gland_motion_mm.max, 6, 1e-12);
}

TEST(SeedScore, UnplannedAndMissingSeedsAreListedApart) {
  std::vector<Seed> seeds = small_seeds();
  seeds[1].planned = Seed::kUnplanned;
  const SeedsScore score = score_seeds(kPlan, kGrid, seeds);
  ASSERT_EQ(score.planned.size(), 2u);
  ASSERT_EQ(score.unplanned.size(), 1u);
  EXPECT_EQ(score.unplanned[0].id, 2u);
  EXPECT_EQ(score.missing, std::vector<std::size_t>{1});
  EXPECT_EQ(score.rest.total_mm.count, 2u);
  EXPECT_NEAR(score.rest.total_mm.mean, 1.5, 1e-12);
  EXPECT_EQ(score.gland_motion_mm.count, 3u);  // it moved for all that fell
}

TEST(SeedScore, ByPositionSeedsOfSwappedNeedlesAreWhereOthersWerePlanned) {
  std::vector<Seed> seeds = small_seeds();
  std::swap(seeds[0].planned, seeds[2].planned);
  const SeedsScore score = score_seeds(kPlan, kGrid, seeds);
  EXPECT_GT(score.rest.total_mm.max, 10);  // by number they are far apart
  const SeedAssignment& a = score.by_position;
  ASSERT_EQ(a.placed.size(), 3u);
  EXPECT_TRUE(a.extra.empty());
  EXPECT_TRUE(a.missing.empty());
  EXPECT_EQ(a.placed[0].planned_index, 0u);
  EXPECT_NEAR(a.placed[0].rest.axial_mm, 3, 1e-12);
  EXPECT_NEAR(a.placed[1].rest.lateral_mm, 4, 1e-12);
  EXPECT_NEAR(a.rest.total_mm.mean, 8.0 / 3, 1e-12);
  EXPECT_EQ(headline(score), "3 of 3 placed, 0 missing, 0 extra; placed ones 2.7 mm mean");
}

TEST(SeedScore, ByPositionAPairBeyondTheLimitIsAnExtraAndAMissingSeed) {
  for (const double aside : {9.999, 10.001}) {
    std::vector<Seed> seeds = small_seeds();
    seeds[2].rest.x() += aside;
    const SeedsScore score = score_seeds(kPlan, kGrid, seeds);
    const SeedAssignment& a = score.by_position;
    if (aside < SeedAssignment::kFarthestMm) {
      EXPECT_EQ(a.placed.size(), 3u);
      continue;
    }
    ASSERT_EQ(a.extra.size(), 1u);
    EXPECT_EQ(a.extra[0].id, 3u);
    EXPECT_EQ(a.missing, std::vector<std::size_t>{2});
    EXPECT_EQ(headline(score), "2 of 3 placed, 1 missing, 1 extra; placed ones 4.0 mm mean");
  }
}

TEST(SeedScore, ByPositionASeedThatLiesExactlyRightIsPlacedWhateverItsNumber) {
  // As when a button is pressed twice: the second seed takes the next number of the needle.
  std::vector<Seed> seeds = small_seeds();
  seeds[1].planned = Seed::kUnplanned;
  seeds[2].planned = 1;
  const SeedAssignment a = score_seeds(kPlan, kGrid, seeds).by_position;
  ASSERT_EQ(a.placed.size(), 3u);
  EXPECT_EQ(a.placed[2].planned_index, 2u);
  EXPECT_EQ(a.placed[2].rest.total_mm, 0);
}

TEST(SeedScore, OfNoSeedsNothingIsKnown) {
  const SeedsScore score = score_seeds(kPlan, kGrid, {});
  EXPECT_EQ(score.missing.size(), 3u);
  EXPECT_TRUE(std::isnan(score.rest.total_mm.mean));
  EXPECT_TRUE(std::isnan(score.rest.total_mm.max));
  EXPECT_TRUE(std::isnan(score.rest.axial_share));
  EXPECT_TRUE(std::isnan(score.gland_motion_mm.mean));
  EXPECT_EQ(headline(score), "0 of 3 placed, 3 missing, 0 extra");
}

TEST(SeedScore, OfOneSeedThereIsNoDeviationAndOfExactOnesNoShare) {
  const SeedsScore score = score_seeds(kPlan, kGrid, std::vector{small_seeds()[2]});
  EXPECT_EQ(score.rest.total_mm.mean, 0);
  EXPECT_TRUE(std::isnan(score.rest.total_mm.sd));
  EXPECT_TRUE(std::isnan(score.rest.axial_share));
}

TEST(SeedScore, SeedsOfAnotherPlanAreRefused) {
  std::vector<Seed> seeds = small_seeds();
  for (const std::int32_t index : {3, -2}) {
    seeds[1].planned = index;
    try {
      score_seeds(kPlan, kGrid, seeds);
      ADD_FAILURE() << index;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("seed 2 is the plan's seed " + std::to_string(index)),
                std::string::npos)
          << error.what();
    }
  }
}

}  // namespace
}  // namespace brachy
