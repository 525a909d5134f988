#include "core/solve/landmark_repair.h"

#include <gtest/gtest.h>

#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

constexpr double kDistance = 1e-5;

struct Set {
  std::vector<Vec3> positions, displacements;
};

TEST(FindDuplicates, NamesTheFirstLandmarkThatHasOneBeforeIt) {
  const Set set{{{0, 0, 0}, {5, 0, 0}, {9, 0, 0}, {5, 0, 0.9e-5}, {0, 0, 0}},
                std::vector<Vec3>(5, Vec3(1, 0, 0))};
  auto duplicates = find_duplicates(set.positions, set.displacements, kDistance);
  ASSERT_TRUE(duplicates);
  EXPECT_EQ(duplicates->first, 1u);
  EXPECT_EQ(duplicates->second, 3u);
  EXPECT_TRUE(duplicates->agree);
  duplicates = find_duplicates(set.positions, set.displacements, kDistance, 4);
  ASSERT_TRUE(duplicates);
  EXPECT_EQ(duplicates->first, 0u);
  EXPECT_EQ(duplicates->second, 4u);
  EXPECT_FALSE(find_duplicates(set.positions, set.displacements, kDistance, 5));
}

TEST(FindDuplicates, LeavesNeighboursAlone) {
  const Set set{{{0, 0, 0}, {0, 0, 1.01e-5}}, std::vector<Vec3>(2, Vec3::Zero())};
  EXPECT_FALSE(find_duplicates(set.positions, set.displacements, kDistance));
}

TEST(FindDuplicates, AgreeWithinWhatAMeshResolves) {
  const std::vector<Vec3> p(2, Vec3(1, 2, 3));
  EXPECT_TRUE(
      find_duplicates(p, std::vector<Vec3>{{1, 0, 0}, {1, 0, 0.9 * kSameDisplacement}}, kDistance)->agree);
  EXPECT_FALSE(
      find_duplicates(p, std::vector<Vec3>{{1, 0, 0}, {1, 0, 1.1 * kSameDisplacement}}, kDistance)->agree);
}

// Two anchors, then two of the shaft and the tip, identified by their displacement along x.
Set tick() {
  return {{{0, 0, 0}, {10, 0, 0}, {20, 0, 0}, {25, 0, 0}, {30, 0, 0}},
          {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}};
}

TEST(LandmarkRepair, OfTwoAtOnePlaceTheTipThenTheNeedleThenTheEarlierAnchorStays) {
  struct Case {
    int first, second, out;
    Repaired repaired;
  };
  for (const Case& c : {Case{0, 1, 1, Repaired::kMerged}, Case{0, 4, 0, Repaired::kDropped},
                        Case{1, 2, 1, Repaired::kDropped}, Case{2, 3, 2, Repaired::kDropped},
                        Case{3, 4, 3, Repaired::kDropped}}) {
    Set set = tick(), expected = tick();
    LandmarkRepair repair(set.positions, set.displacements, 2);
    EXPECT_EQ(repair.drop({FactorStatus::kDuplicate, c.first, c.second}), c.repaired);
    expected.positions.erase(expected.positions.begin() + c.out);
    expected.displacements.erase(expected.displacements.begin() + c.out);
    EXPECT_EQ(set.positions, expected.positions) << c.first << " " << c.second;
    EXPECT_EQ(set.displacements, expected.displacements);
  }
}

TEST(LandmarkRepair, CountsItsAnchorsDown) {
  Set set = tick();
  LandmarkRepair repair(set.positions, set.displacements, 2);
  repair.drop({FactorStatus::kDuplicate, 0, 4});
  // What was anchor 1 is now 0, and the needle begins at 1.
  EXPECT_EQ(repair.drop({FactorStatus::kDuplicate, 1, 2}), Repaired::kDropped);
  EXPECT_EQ(set.positions, (std::vector<Vec3>{{10, 0, 0}, {25, 0, 0}, {30, 0, 0}}));
}

TEST(LandmarkRepair, TakesOneOfTheClosestTwoThenTwoThenFour) {
  std::mt19937_64 random(1);
  Set set{test::random_landmarks(random, 30, 20, 3, 1).positions, std::vector<Vec3>(30, Vec3(0, 0, 1))};
  const Vec3 tip = set.positions.back();
  set.positions[3] = set.positions[17] + Vec3(0, 0, 1e-3);
  const std::vector<Vec3> before = set.positions;
  LandmarkRepair repair(set.positions, set.displacements, 10);
  EXPECT_EQ(repair.drop({FactorStatus::kIllConditioned, -1, -1, 1e13}), Repaired::kDropped);
  ASSERT_EQ(set.positions.size(), 29u);
  EXPECT_EQ(std::ranges::count(set.positions, before[3]), 0);  // the anchor of the two
  std::vector<std::size_t> sizes;
  while (repair.drop({FactorStatus::kNotPositiveDefinite}) != Repaired::kNothing)
    sizes.push_back(set.positions.size());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{27, 23, 15, 1}));
  EXPECT_EQ(set.positions, std::vector<Vec3>{tip});
  EXPECT_EQ(set.displacements.size(), 1u);
}

TEST(LandmarkRepair, CannotRepairWhatIsNotFinite) {
  Set set = tick();
  LandmarkRepair repair(set.positions, set.displacements, 2);
  EXPECT_EQ(repair.drop({FactorStatus::kNotFinite, 2}), Repaired::kNothing);
  EXPECT_EQ(set.positions, tick().positions);
}

}  // namespace
}  // namespace brachy
