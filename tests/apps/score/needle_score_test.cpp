#include "apps/score/needle_score.h"

#include <gtest/gtest.h>

#include "tests/apps/score/score_fixtures.h"

namespace brachy {
namespace {

using namespace test;

const InsideTest kAbove = [](const Vec3& p) { return p.z() > -20; };
constexpr auto kFree = ContactState::kFree, kTouching = ContactState::kTouching,
               kInserted = ContactState::kInserted, kWithdrawn = ContactState::kWithdrawn;

/// Needle 0 through D4 for 30 mm in 3 s, out, then through F6, 1.5 mm beside it, for 10 mm in 1 s; needle 2 through
/// C9, which is not in the plan.
NeedleTrajectories session() {
  return NeedleTrajectories(
      {{0, Trajectory({straight(0, -15, -15, -40), straight(1, -15, -15, -15), straight(4, -15, -15, 15),
                       straight(5, -15, -15, -40), straight(6, -3.5, -5, -40), straight(7, -3.5, -5, 0),
                       straight(8, -3.5, -5, 10), straight(9, -3.5, -5, -40)})},
       {2, Trajectory({straight(2, -20, 10, -30), straight(3, -20, 10, -10), straight(4, -20, 10, -30)})}});
}

TEST(NeedleScore, APlansNeedleIsTheOneThroughItsHole) {
  const NeedleTrajectories poses = session();
  const NeedlesScore score = score_needles(holes_of(kPlan.needles), kGrid, &poses, {}, kAbove);
  ASSERT_EQ(score.needles.size(), 3u);
  EXPECT_EQ(score.needles[0].hole, "D4");
  EXPECT_EQ(score.needles[0].planned, 0u);
  EXPECT_EQ(score.needles[0].path_in_tissue_mm, 55);  // includes the segment on which the tip enters
  EXPECT_EQ(score.needles[0].time_in_tissue_s, 4);
  EXPECT_EQ(score.needles[0].passes, 1u);
  EXPECT_EQ(score.needles[1].hole, "F6");
  EXPECT_EQ(score.needles[1].path_in_tissue_mm, 50);
  EXPECT_EQ(score.needles[2].hole, "C9");
  EXPECT_FALSE(score.needles[2].planned);
  EXPECT_EQ(score.needles[2].path_in_tissue_mm, 20);
  ASSERT_TRUE(score.motion);
  EXPECT_EQ(score.motion->path_in_tissue_mm, 125);
  EXPECT_EQ(score.motion->passes, 3u);
  EXPECT_EQ(score.motion->elapsed_time_s, 9);
}

TEST(NeedleScore, WithoutAForceLogForcesAreNotKnown) {
  const NeedleTrajectories poses = session();
  const NeedlesScore score = score_needles(holes_of(kPlan.needles), kGrid, &poses, {}, kAbove);
  EXPECT_FALSE(score.punctures);
  EXPECT_FALSE(score.needles[0].punctures);
  EXPECT_TRUE(std::isnan(score.largest_force_n));
  EXPECT_TRUE(std::isnan(score.needles[0].largest_force_n));
}

TEST(NeedleScore, ForcesAndPuncturesGoToTheHoleTheNeedleIsIn) {
  const NeedleTrajectories poses = session();
  const std::vector<RecordedForce> forces = {
      force_at(0.5, 0, kTouching, Vec3(0, 3, -4)), force_at(1, 0, kInserted, Vec3(0, 0, -2)),
      force_at(2.5, 2, kTouching, Vec3(0, 0, -1)), force_at(3, 2, kTouching, Vec3(0, 0, -1.5)),
      force_at(5, 0, kWithdrawn, Vec3::Zero()),    force_at(6.5, 0, kTouching, Vec3(0, 0, -6)),
      force_at(7.5, 0, kInserted, Vec3(0, 0, 1)),  force_at(7.6, 0, kTouching, Vec3(0, 0, -1)),
      force_at(7.7, 0, kInserted, Vec3(0, 0, 1))};
  const NeedlesScore score = score_needles(holes_of(kPlan.needles), kGrid, &poses, forces, kAbove);
  EXPECT_EQ(score.needles[0].punctures, 1u);
  EXPECT_EQ(score.needles[0].largest_force_n, 5);
  EXPECT_EQ(score.needles[1].punctures, 2u);
  EXPECT_EQ(score.needles[1].largest_force_n, 6);
  EXPECT_EQ(score.needles[2].punctures, 0u);
  EXPECT_EQ(score.needles[2].largest_force_n, 1.5);
  EXPECT_EQ(score.punctures, 3u);
  EXPECT_EQ(score.largest_force_n, 6);
}

TEST(NeedleScore, WithoutPosesForcesAreKnownInAllOnly) {
  const std::vector<RecordedForce> forces = {force_at(0, 0, kFree, Vec3::Zero()),
                                             force_at(1, 0, kTouching, Vec3(0, 0, -5)),
                                             force_at(2, 0, kInserted, Vec3(0, 0, -2))};
  const NeedlesScore score = score_needles(holes_of(kPlan.needles), kGrid, nullptr, forces, kAbove);
  ASSERT_EQ(score.needles.size(), 2u);
  EXPECT_FALSE(score.needles[0].passes);
  EXPECT_FALSE(score.needles[0].punctures);
  EXPECT_TRUE(std::isnan(score.needles[0].path_in_tissue_mm));
  EXPECT_FALSE(score.motion);
  EXPECT_EQ(score.punctures, 1u);
  EXPECT_EQ(score.largest_force_n, 5);
}

TEST(NeedleScore, ANeedleBesideTheTemplateHasNoHole) {
  const NeedleTrajectories poses({{0, Trajectory({straight(0, 200, 0, -40), straight(1, 200, 0, 0)})}});
  const NeedlesScore score = score_needles(holes_of(kPlan.needles), kGrid, &poses, {}, kAbove);
  ASSERT_EQ(score.needles.size(), 3u);
  EXPECT_EQ(score.needles[2].hole, "");
  EXPECT_FALSE(score.needles[2].planned);
  EXPECT_EQ(score.needles[2].path_in_tissue_mm, 40);
  EXPECT_EQ(score.needles[0].path_in_tissue_mm, 0);  // was not used
  EXPECT_EQ(score.needles[0].passes, 0u);
}

TEST(NeedleScore, AStayIsTheHolesThatItIsInForMostPoses) {
  // A hand that wavers into the next column and back.
  const NeedleTrajectories poses({{0, Trajectory({straight(0, -15, -15, -40), straight(1, -15, -15, -10),
                                                  straight(2, -12, -15, 0), straight(3, -15, -15, 5)})}});
  const NeedlesScore score = score_needles(holes_of(kPlan.needles), kGrid, &poses, {}, kAbove);
  ASSERT_EQ(score.needles.size(), 2u);
  EXPECT_NEAR(score.needles[0].path_in_tissue_mm, 30 + std::hypot(3, 10) + std::hypot(3, 5), 1e-12);
}

}  // namespace
}  // namespace brachy
