#include "core/conditioning/landmark_hygiene.h"

#include <gtest/gtest.h>

#include "tests/core/rbf/random_landmarks.h"

namespace brachy {
namespace {

constexpr double kDistance = 1e-5;

struct Set {
  std::vector<Vec3> positions, displacements;
};

TEST(FindTwins, NamesTheFirstLandmarkThatHasOneBeforeIt) {
  const Set set{{{0, 0, 0}, {5, 0, 0}, {9, 0, 0}, {5, 0, 0.9e-5}, {0, 0, 0}},
                std::vector<Vec3>(5, Vec3(1, 0, 0))};
  auto twins = find_twins(set.positions, set.displacements, kDistance);
  ASSERT_TRUE(twins);
  EXPECT_EQ(twins->first, 1u);
  EXPECT_EQ(twins->second, 3u);
  EXPECT_TRUE(twins->agree);
  twins = find_twins(set.positions, set.displacements, kDistance, 4);
  ASSERT_TRUE(twins);
  EXPECT_EQ(twins->first, 0u);
  EXPECT_EQ(twins->second, 4u);
  EXPECT_FALSE(find_twins(set.positions, set.displacements, kDistance, 5));
}

TEST(FindTwins, LeavesNeighboursAlone) {
  const Set set{{{0, 0, 0}, {0, 0, 1.01e-5}}, std::vector<Vec3>(2, Vec3::Zero())};
  EXPECT_FALSE(find_twins(set.positions, set.displacements, kDistance));
}

TEST(FindTwins, AgreeWithinWhatAMeshResolves) {
  const std::vector<Vec3> p(2, Vec3(1, 2, 3));
  EXPECT_TRUE(find_twins(p, std::vector<Vec3>{{1, 0, 0}, {1, 0, 0.9 * kSameDisplacement}}, kDistance)->agree);
  EXPECT_FALSE(
      find_twins(p, std::vector<Vec3>{{1, 0, 0}, {1, 0, 1.1 * kSameDisplacement}}, kDistance)->agree);
}

// Two anchors, then two of the shaft and the tip, told apart by their displacement along x.
Set tick() {
  return {{{0, 0, 0}, {10, 0, 0}, {20, 0, 0}, {25, 0, 0}, {30, 0, 0}},
          {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}};
}

TEST(LandmarkMender, OfTwoAtOnePlaceTheTipThenTheNeedleThenTheEarlierAnchorStays) {
  struct Case {
    int first, second, out;
    Mended mended;
  };
  for (const Case& c :
       {Case{0, 1, 1, Mended::kMerged}, Case{0, 4, 0, Mended::kDropped}, Case{1, 2, 1, Mended::kDropped},
        Case{2, 3, 2, Mended::kDropped}, Case{3, 4, 3, Mended::kDropped}}) {
    Set set = tick(), expected = tick();
    LandmarkMender mender(set.positions, set.displacements, 2);
    EXPECT_EQ(mender.mend({FactorStatus::kDuplicate, c.first, c.second}), c.mended);
    expected.positions.erase(expected.positions.begin() + c.out);
    expected.displacements.erase(expected.displacements.begin() + c.out);
    EXPECT_EQ(set.positions, expected.positions) << c.first << " " << c.second;
    EXPECT_EQ(set.displacements, expected.displacements);
  }
}

TEST(LandmarkMender, CountsItsAnchorsDown) {
  Set set = tick();
  LandmarkMender mender(set.positions, set.displacements, 2);
  mender.mend({FactorStatus::kDuplicate, 0, 4});
  // What was anchor 1 is now 0, and the needle begins at 1.
  EXPECT_EQ(mender.mend({FactorStatus::kDuplicate, 1, 2}), Mended::kDropped);
  EXPECT_EQ(set.positions, (std::vector<Vec3>{{10, 0, 0}, {25, 0, 0}, {30, 0, 0}}));
}

TEST(LandmarkMender, TakesOneOfTheClosestTwoThenTwoThenFour) {
  std::mt19937_64 random(1);
  Set set{test::random_landmarks(random, 30, 20, 3, 1).positions, std::vector<Vec3>(30, Vec3(0, 0, 1))};
  const Vec3 tip = set.positions.back();
  set.positions[3] = set.positions[17] + Vec3(0, 0, 1e-3);
  const std::vector<Vec3> before = set.positions;
  LandmarkMender mender(set.positions, set.displacements, 10);
  EXPECT_EQ(mender.mend({FactorStatus::kIllConditioned, -1, -1, 1e13}), Mended::kDropped);
  ASSERT_EQ(set.positions.size(), 29u);
  EXPECT_EQ(std::ranges::count(set.positions, before[3]), 0);  // the anchor of the two
  std::vector<std::size_t> sizes;
  while (mender.mend({FactorStatus::kNotPositiveDefinite}) != Mended::kNothing)
    sizes.push_back(set.positions.size());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{27, 23, 15, 1}));
  EXPECT_EQ(set.positions, std::vector<Vec3>{tip});
  EXPECT_EQ(set.displacements.size(), 1u);
}

TEST(LandmarkMender, CannotMendWhatIsNotFinite) {
  Set set = tick();
  LandmarkMender mender(set.positions, set.displacements, 2);
  EXPECT_EQ(mender.mend({FactorStatus::kNotFinite, 2}), Mended::kNothing);
  EXPECT_EQ(set.positions, tick().positions);
}

}  // namespace
}  // namespace brachy
