#include "core/brachytherapy/seeds/seed_loading.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/brachytherapy/seeds/remaining_seeds.h"

namespace brachy {
namespace {

NeedlePose pose(const Vec3& tip, bool button) {
  NeedlePose p;
  p.X_WN.p = tip;
  p.button = button;
  p.present = true;
  return p;
}

/// Two needles: D4 with seeds at 2.25, 12.25 and 16.75 mm behind the tip, E4 with one; G8 with a leading spacer.
Plan small_plan() {
  Plan plan;
  plan.base_plane_mm = 60;
  plan.needles = {{"D4", 0, "s-ss"}, {"E4", 5, "s"}, {"G8", 0, "-s"}};
  return plan;
}

const TemplateGrid kGrid;

SeedSettings settings(const std::string& applicator) {
  SeedSettings s;
  s.applicator = applicator;
  s.source = SourceModel::kTheraSeed200;
  s.air_kerma_strength_u = 1.5;
  return s;
}

Vec3 at(const char* hole, double z) {
  Vec3 p = *kGrid.position(hole);
  p.z() = z;
  return p;
}

TEST(SeedLoading, ASinglePressDropsOneSeedAtTheTipHoweverLongItIsHeld) {
  SeedLoading loading(settings("single"), kGrid, std::nullopt, 1);
  loading.update(0, pose({1, 2, 3}, false));
  EXPECT_FALSE(loading.due(0));
  loading.update(0, pose({1, 2, 3}, true));
  const auto drop = loading.due(0);
  ASSERT_TRUE(drop);
  EXPECT_EQ(drop->at, Vec3(1, 2, 3));
  EXPECT_EQ(drop->planned, Seed::kUnplanned);
  EXPECT_EQ(drop->source, SourceModel::kTheraSeed200);
  EXPECT_EQ(drop->air_kerma_strength_u, 1.5);
  loading.dropped(0);
  EXPECT_FALSE(loading.due(0));
  loading.update(0, pose({1, 2, 2}, true));
  EXPECT_FALSE(loading.due(0));
  loading.update(0, pose({1, 2, 2}, false));
  loading.update(0, pose({1, 2, 1}, true));
  EXPECT_TRUE(loading.due(0));
}

TEST(SeedLoading, ASinglePressInAHoleOfThePlanTakesItsSeedsFromTheTipBackwardsThenTheScenes) {
  SeedLoading loading(settings("single"), kGrid, small_plan(), 1);
  for (const int planned : {0, 1, 2, -1}) {
    loading.update(0, pose(at("D4", 0) + Vec3(2.4, -2.4, 0), true));
    ASSERT_TRUE(loading.due(0));
    EXPECT_EQ(loading.due(0)->planned, planned);
    EXPECT_EQ(loading.due(0)->source, planned < 0 ? SourceModel::kTheraSeed200 : SourceModel::kAmersham6711);
    loading.dropped(0);
    loading.update(0, pose(at("D4", 0), false));
  }
  loading.update(0, pose(at("E4", 0) + Vec3(-2.4, 2.4, 0), true));
  EXPECT_EQ(loading.due(0)->planned, 3);
}

TEST(SeedLoading, ATiltedNeedleIsThatOfTheHoleItsLinePasses) {
  SeedLoading loading(settings("single"), kGrid, small_plan(), 1);
  NeedlePose tilted = pose(Vec3::Zero(), true);
  const Vec3 axis = Vec3(0.1, 0, 1).normalized();
  tilted.X_WN.R = Eigen::AngleAxisd(std::atan2(axis.x(), axis.z()), Vec3::UnitY()).toRotationMatrix();
  tilted.X_WN.p = *kGrid.position("E4") + 70 * axis;  // by now in front of F4
  loading.update(0, tilted);
  EXPECT_EQ(loading.due(0)->planned, 3);
}

// The stylet holds the seeds fixed in the world; each falls where the tip passes its centre.
TEST(SeedLoading, ATrainStaysBehindAsTheNeedleIsDrawnBack) {
  SeedLoading loading(settings("train"), kGrid, small_plan(), 1);
  const double deep = 20;
  loading.update(0, pose(at("D4", deep), false));
  loading.update(0, pose(at("D4", deep), true));
  EXPECT_FALSE(loading.due(0));
  std::vector<std::pair<int, double>> fallen;
  for (double z = deep; z > deep - 30; z -= 0.7) {
    loading.update(0, pose(at("D4", z), true));
    while (const auto drop = loading.due(0)) {
      fallen.emplace_back(drop->planned, drop->at.z());
      EXPECT_EQ(drop->at.x(), at("D4", 0).x());
      loading.dropped(0);
    }
  }
  const double behind[] = {2.25, 12.25, 16.75};
  ASSERT_EQ(fallen.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(fallen[i].first, static_cast<int>(i));
    EXPECT_NEAR(fallen[i].second, deep - behind[i], 1e-12);
  }
}

TEST(SeedLoading, ALeadingSpacerKeepsTheSeedBack) {
  SeedLoading loading(settings("train"), kGrid, small_plan(), 1);
  loading.update(0, pose(at("G8", 20), true));
  loading.update(0, pose(at("G8", 20 - 7.7), true));
  EXPECT_FALSE(loading.due(0));
  loading.update(0, pose(at("G8", 20 - 7.8), true));
  ASSERT_TRUE(loading.due(0));
  EXPECT_NEAR(loading.due(0)->at.z(), 20 - 7.75, 1e-12);
}

TEST(SeedLoading, SeveralSeedsCanFallWithinATick) {
  SeedLoading loading(settings("train"), kGrid, small_plan(), 1);
  loading.update(0, pose(at("D4", 20), true));
  loading.update(0, pose(at("D4", -10), true));
  int count = 0;
  for (; loading.due(0); ++count) loading.dropped(0);
  EXPECT_EQ(count, 3);
}

TEST(SeedLoading, ReleasedEarlyTheRestIsAtTheTipAtTheNextPress) {
  SeedLoading loading(settings("train"), kGrid, small_plan(), 1);
  loading.update(0, pose(at("D4", 20), true));
  loading.update(0, pose(at("D4", 17), true));
  ASSERT_TRUE(loading.due(0));
  loading.dropped(0);
  loading.update(0, pose(at("D4", 17), false));
  loading.update(0, pose(at("D4", -5), false));
  EXPECT_FALSE(loading.due(0));  // without the stylet nothing falls
  loading.update(0, pose(at("D4", -5), true));
  loading.update(0, pose(at("D4", -7.2), true));
  EXPECT_FALSE(loading.due(0));
  loading.update(0, pose(at("D4", -7.3), true));
  ASSERT_TRUE(loading.due(0));
  EXPECT_EQ(loading.due(0)->planned, 1);
  EXPECT_NEAR(loading.due(0)->at.z(), -7.25, 1e-12);
}

/// Presses at the tip and draws back over a whole train; the seeds that fall.
std::vector<int> drawn_back(SeedLoading& loading, const Vec3& tip) {
  std::vector<int> fallen;
  loading.update(0, pose(tip, false), true);
  loading.update(0, pose(tip, true), true);
  loading.update(0, pose(tip - Vec3(0, 0, 25), true), true);
  while (const auto drop = loading.due(0)) {
    fallen.push_back(drop->planned);
    loading.dropped(0);
  }
  loading.update(0, pose(tip - Vec3(0, 0, 25), false), true);
  return fallen;
}

/// Out through the template, as to take the next needle.
void put_aside(SeedLoading& loading) {
  loading.update(0, pose({0, 0, kGrid.origin_mm.z() - 5}, false));
}

TEST(SeedLoading, ThroughAFreeHoleTheNeedleDropsThePlansFirstUntouchedTrain) {
  SeedLoading loading(settings("train"), kGrid, small_plan(), 1);
  EXPECT_EQ(drawn_back(loading, at("E4", 20)), std::vector{3});
  put_aside(loading);
  EXPECT_EQ(drawn_back(loading, at("A1", 20)), (std::vector{0, 1, 2}));
  put_aside(loading);
  EXPECT_TRUE(drawn_back(loading, at("D4", 20)).empty());  // its train lies elsewhere
  put_aside(loading);
  EXPECT_EQ(drawn_back(loading, at("G8", 20)), std::vector{4});
}

TEST(SeedLoading, HandedOutInThePlansOrderTwoSwappedNeedlesKeepTheirTrains) {
  SeedSettings in_order = settings("train");
  in_order.loading = "order";
  SeedLoading loading(in_order, kGrid, small_plan(), 1);
  EXPECT_EQ(drawn_back(loading, at("E4", 20)), (std::vector{0, 1, 2}));
  put_aside(loading);
  EXPECT_EQ(drawn_back(loading, at("D4", 20)), std::vector{3});
}

TEST(SeedLoading, ANeedleThatIsNotPutAsideKeepsItsTrain) {
  for (const bool moves_in_tissue : {true, false}) {
    SeedLoading loading(settings("train"), kGrid, small_plan(), 1);
    loading.update(0, pose(at("D4", 20), true), true);
    loading.update(0, pose(at("D4", 20), false), true);
    loading.update(0, pose(at("E4", 20), false), moves_in_tissue);  // its line passes another hole
    // Once out of the tissue it is another needle, that of the other hole.
    EXPECT_EQ(drawn_back(loading, at("E4", 20)), moves_in_tissue ? (std::vector{0, 1, 2}) : std::vector{3});
  }
}

TEST(SeedLoading, AnEmptyNeedleIsAskedInVain) {
  SeedLoading loading(settings("train"), kGrid, small_plan(), 1);
  EXPECT_EQ(drawn_back(loading, at("E4", 20)).size(), 1u);
  loading.update(0, pose(at("E4", 20), true), true);
  EXPECT_TRUE(loading.request_failed(0));
}

TEST(SeedLoading, ATrainAskedForWhereThePlanHasNoneLeftIsAskedInVainOnce) {
  SeedLoading loading(settings("train"), kGrid, small_plan(), 1);
  for (const std::int32_t planned : {0, 3, 4}) loading.mark_dropped(planned);
  loading.update(0, pose(at("A1", 20), true));
  EXPECT_TRUE(loading.request_failed(0));
  loading.update(0, pose(at("A1", 19), true));
  EXPECT_FALSE(loading.request_failed(0));
  EXPECT_FALSE(loading.due(0));
}

TEST(SeedLoading, ARefusedSeedStaysASinglePressIsSpentATrainTriesAgain) {
  SeedLoading single(settings("single"), kGrid, small_plan(), 1);
  single.update(0, pose(at("E4", 0), true));
  EXPECT_TRUE(single.refused(0));
  EXPECT_FALSE(single.due(0));
  single.update(0, pose(at("E4", 0), false));
  single.update(0, pose(at("E4", 0), true));
  EXPECT_EQ(single.due(0)->planned, 3);  // the same seed

  SeedLoading train(settings("train"), kGrid, small_plan(), 1);
  train.update(0, pose(at("E4", 0), true));
  train.update(0, pose(at("E4", -3), true));
  ASSERT_TRUE(train.due(0));
  EXPECT_TRUE(train.refused(0));
  EXPECT_FALSE(train.due(0));
  train.update(0, pose(at("E4", -4), true));
  ASSERT_TRUE(train.due(0));
  EXPECT_EQ(train.due(0)->at, at("E4", -4));  // where it can be dropped now
  EXPECT_FALSE(train.refused(0));             // not reported again
}

TEST(SeedLoading, SeedsOfAnEarlierRunAreGone) {
  SeedLoading loading(settings("single"), kGrid, small_plan(), 1);
  loading.mark_dropped(0);
  loading.mark_dropped(Seed::kUnplanned);
  loading.mark_dropped(4711);
  loading.update(0, pose(at("D4", 0), true));
  EXPECT_EQ(loading.due(0)->planned, 1);
}

TEST(SeedLoading, NeedlesDoNotMix) {
  SeedLoading loading(settings("single"), kGrid, small_plan(), 2);
  loading.update(0, pose(at("D4", 0), true));
  loading.update(1, pose(at("E4", 0), false));
  EXPECT_TRUE(loading.due(0));
  EXPECT_FALSE(loading.due(1));
}

NeedlePose loaded(NeedlePose pose, std::uint32_t number, std::int32_t plan_needle) {
  pose.load_number = number;
  pose.load = plan_needle;
  return pose;
}

TEST(SeedLoading, AnOperatorLoadsATrainThatFallsThroughWhicheverHole) {
  const Plan plan = small_plan();
  SeedLoading loading(settings("train"), kGrid, plan, 1);
  // Loaded as E4, and taken through D4.
  loading.update(0, loaded(pose(at("D4", -65), false), 1, 1));
  loading.update(0, loaded(pose(at("D4", 0), false), 1, 1));
  loading.update(0, loaded(pose(at("D4", 0), true), 1, 1));
  loading.update(0, loaded(pose(at("D4", -3), true), 1, 1));
  const auto drop = loading.due(0);
  ASSERT_TRUE(drop);
  EXPECT_EQ(drop->planned, 3);  // E4's only seed
  loading.dropped(0);
  EXPECT_FALSE(loading.due(0));
}

TEST(SeedLoading, AMagazineIsLoadedToo) {
  const Plan plan = small_plan();
  SeedLoading loading(settings("single"), kGrid, plan, 1);
  std::vector<std::int32_t> fallen;
  for (int press = 0; press < 5; ++press) {
    loading.update(0, loaded(pose(at("G8", 0), false), 1, 0));
    loading.update(0, loaded(pose(at("G8", 0), true), 1, 0));
    const auto drop = loading.due(0);
    ASSERT_TRUE(drop);
    fallen.push_back(drop->planned);
    loading.dropped(0);
  }
  // D4's three, then that of the hole it is in, then none of the plan's.
  EXPECT_EQ(fallen, (std::vector<std::int32_t>{0, 1, 2, 4, Seed::kUnplanned}));
}

TEST(SeedLoading, ATrainThatAnotherNeedleCarriesOrThatIsGoneIsRefused) {
  const Plan plan = small_plan();
  SeedLoading loading(settings("train"), kGrid, plan, 2);
  loading.update(0, loaded(pose(at("D4", 0), false), 1, 0));
  EXPECT_FALSE(loading.request_failed(0));
  loading.update(1, loaded(pose(at("E4", 0), false), 1, 0));
  EXPECT_TRUE(loading.request_failed(1));
  loading.update(1, loaded(pose(at("E4", 0), false), 1, 0));
  EXPECT_FALSE(loading.request_failed(1));  // said once
  loading.mark_dropped(3);
  loading.update(1, loaded(pose(at("E4", 0), false), 2, 1));
  EXPECT_TRUE(loading.request_failed(1));
  loading.update(1, loaded(pose(at("E4", 0), false), 3, 99));
  EXPECT_TRUE(loading.request_failed(1));
}

TEST(RemainingSeeds, AreThoseThatNeitherFellNorWereLost) {
  const std::vector<PlannedSeed> planned = small_plan().seeds(kGrid);
  Seed fallen, unplanned;
  fallen.planned = 1;
  const std::vector<std::int32_t> lost = {3};
  const std::vector<Seed> seeds = {fallen, unplanned};
  const auto rest = remaining_seeds(planned, seeds, lost);
  ASSERT_EQ(rest.size(), planned.size() - 2);
  EXPECT_EQ(rest[0].position, planned[0].position);
  EXPECT_EQ(rest[1].position, planned[2].position);
  EXPECT_EQ(rest[2].position, planned[4].position);
}

}  // namespace
}  // namespace brachy
