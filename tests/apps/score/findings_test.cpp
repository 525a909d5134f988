// One deliberate mistake each, in a plan of nine needles; what the score says of it first.
#include "apps/score/findings.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "apps/score/score.h"
#include "core/brachytherapy/structures/phantom_structures.h"
#include "tests/apps/score/score_fixtures.h"

namespace brachy {
namespace {

using namespace test;

Plan plan_of_nine() {
  Plan plan;
  plan.base_plane_mm = 75;
  for (const char* hole : {"E5", "G5", "I5", "E8", "G9", "I8", "D7", "J7", "E6"})
    plan.needles.push_back({hole, 0, "s-s-s"});
  return plan;
}

/// Sessions of plan_of_nine: each needle goes in from before the template, drops its seeds, and comes out.
struct Sessions : ::testing::Test {
  Plan plan = plan_of_nine();
  std::vector<PlannedSeed> planned = plan.seeds(kGrid);
  std::vector<Structure> structures = {{"prostate", octahedron(40)}, {"urethra", phantom_urethra()}};
  std::vector<Seed> seeds;
  std::vector<TrajectorySample> poses;
  double speed_mm_s = 50;

  void go_to(const Vec3& tip) {
    if (poses.empty()) return poses.push_back(straight(0, tip.x(), tip.y(), tip.z()));
    const Vec3 from = poses.back().X_WN.p;
    const double length = (tip - from).norm();
    const int steps = std::max(1, static_cast<int>(std::ceil(length)));
    const double t_s = poses.back().t_s;
    for (int i = 1; i <= steps; ++i) {
      const Vec3 p = from + (tip - from) * i / steps;
      poses.push_back(straight(t_s + length / speed_mm_s * i / steps, p.x(), p.y(), p.z()));
    }
  }
  void puncture(const Vec3& hole, double depth_z) {
    const Vec3 before(hole.x(), hole.y(), kGrid.origin_mm.z() - 5);
    go_to(before);
    go_to({hole.x(), hole.y(), depth_z});
    go_to(before);
  }
  void drop(std::size_t index, const Vec3& off) {
    seeds.push_back(seed_beside(planned[index], static_cast<std::uint32_t>(seeds.size() + 1),
                                static_cast<int>(index), off, off));
  }
  /// Needle n with its tip and seeds off by `off`, the last `kept` of them not dropped.
  void implant(std::size_t n, const Vec3& off = Vec3::Zero(), std::size_t kept = 0) {
    const Vec3 tip = plan.planned_tip(kGrid, n) + off;
    puncture(tip, tip.z());
    for (std::size_t i = 0; i + kept < 3; ++i) drop(3 * n + i, off);
  }
  void implant_all_but(std::size_t n, const Vec3& off = Vec3::Zero()) {
    for (std::size_t i = 0; i < plan.needles.size(); ++i)
      if (i != n) implant(i, off);
  }
  static constexpr std::size_t kNone = 99;

  std::vector<Finding> findings() const {
    Recording recording;
    recording.seeds = seeds;
    recording.poses = NeedleTrajectories({{0, Trajectory(std::vector(poses))}});
    return score_session(plan, kGrid, structures, {.spacing_mm = 4, .margin_mm = 2, .source = {}}, recording)
        .findings;
  }
  /// Whether one of the first three contains `part`.
  ::testing::AssertionResult says(const std::string& part) const {
    std::string all;
    const auto found = findings();
    for (std::size_t i = 0; i < std::min<std::size_t>(3, found.size()); ++i) {
      if (found[i].text.find(part) != std::string::npos) return ::testing::AssertionSuccess();
      all += "\n" + found[i].text;
    }
    return ::testing::AssertionFailure() << "not \"" << part << "\" in:" << all;
  }
};

TEST_F(Sessions, OfAPerfectOneThereIsNothingToSay) {
  implant_all_but(kNone);
  EXPECT_TRUE(findings().empty()) << findings().front().text;
}

TEST_F(Sessions, TooShallow) {
  implant_all_but(kNone, {0, 0, -5});
  EXPECT_TRUE(says("too shallow: the seeds fell 5.0 mm short"));
}

TEST_F(Sessions, TooDeep) {
  implant_all_but(kNone, {0, 0, 5});
  EXPECT_TRUE(says("too deep: the seeds fell 5.0 mm beyond"));
}

TEST_F(Sessions, AllToOneSide) {
  implant_all_but(kNone, {2, 0, 0});
  EXPECT_TRUE(says("to one side: the seeds fell 2.0 mm off on the whole (x +2.0, y +0.0)"));
}

TEST_F(Sessions, OneNeedleSkipped) {
  implant_all_but(4);
  EXPECT_TRUE(says("1 needle left no seed in place: G9; 3 seeds missing"));
}

TEST_F(Sessions, FourOfOneSideSkipped) {
  for (const std::size_t n : {1u, 2u, 4u, 5u, 7u}) implant(n);
  EXPECT_TRUE(says("4 needles left no seed in place: E5, E8, D7, E6; 12 seeds missing"));
}

TEST_F(Sessions, ThroughTheNeighbouringHole) {
  implant_all_but(4);
  implant(4, {kGrid.spacing_mm, 0, 0});
  EXPECT_TRUE(says("needle G9 went through H9: its 3 seeds lie 5.0 mm aside"));
}

TEST_F(Sessions, TwoNeedlesSwapped) {
  const Vec3 way = plan.planned_tip(kGrid, 7) - plan.planned_tip(kGrid, 6);
  for (const std::size_t n : {0u, 1u, 2u, 3u, 4u, 5u, 8u}) implant(n);
  implant(6, way);
  implant(7, -way);
  EXPECT_TRUE(says("needles D7 and J7 were swapped"));
}

TEST_F(Sessions, ATrainReleasedHalfWay) {
  implant_all_but(4);
  implant(4, Vec3::Zero(), 2);
  EXPECT_TRUE(says("needle G9: 2 of its 3 seeds are missing"));
}

TEST_F(Sessions, OneNeedleTwice) {
  implant_all_but(kNone);
  puncture(planned[0].position, 10);
  EXPECT_TRUE(says("entered again through the same hole: E5 2 times"));
}

// Seed n fell at n s (seed_beside).
TEST_F(Sessions, OfSeedsIsOfTheTimeAtWhichTheFirstFell) {
  implant_all_but(4);
  implant(4, {0, 0, 8});
  const auto found = findings();
  ASSERT_FALSE(found.empty());
  EXPECT_NE(found[0].text.find("too deep"), std::string::npos) << found[0].text;
  EXPECT_EQ(found[0].at_s, 25) << "nine needles of three seeds, this one last";
}

TEST_F(Sessions, OfMissingSeedsIsOfTheTimeOfTheirNeedlesLast) {
  implant_all_but(4);
  implant(4, Vec3::Zero(), 1);
  const auto found = findings();
  ASSERT_FALSE(found.empty());
  EXPECT_NE(found[0].text.find("needle G9: 1 of its 3 seeds is missing"), std::string::npos) << found[0].text;
  EXPECT_EQ(found[0].at_s, 26);
  seeds.clear();
  implant_all_but(4);
  EXPECT_EQ(findings().at(0).at_s, std::nullopt) << "a needle that was left out is of no moment";
}

TEST_F(Sessions, OfANeedleIsOfTheTimeAtWhichItWentInAgain) {
  implant_all_but(kNone);
  const double before_s = poses.back().t_s;
  puncture(planned[0].position, 10);
  for (const Finding& finding : findings())
    if (finding.cause == "punctured_again") {
      ASSERT_TRUE(finding.at_s);
      EXPECT_GT(*finding.at_s, before_s);
      EXPECT_LT(*finding.at_s, poses.back().t_s);
      return;
    }
  FAIL() << "not found";
}

TEST_F(Sessions, SixPuncturesWithoutSeeds) {
  implant_all_but(kNone);
  for (const char* hole : {"F5", "H5", "F9", "H9", "C7", "K7"}) puncture(*kGrid.position(hole), 0);
  EXPECT_TRUE(says("6 punctures without a seed"));
}

TEST_F(Sessions, FiveTimesTooFast) {
  speed_mm_s = 250;
  implant_all_but(kNone);
  EXPECT_TRUE(says("too fast"));
}

TEST_F(Sessions, ClinicalNoise) {
  std::mt19937 random(5);
  std::normal_distribution<double> across(0, 1.3), along(0, 4.7);
  for (std::size_t n = 0; n < plan.needles.size(); ++n) {
    implant(n, Vec3::Zero(), 3);
    for (std::size_t i = 0; i < 3; ++i) {
      const double x = across(random), y = across(random);
      drop(3 * n + i, {x, y, along(random)});
    }
  }
  EXPECT_TRUE(says("depths scatter"));
}

TEST_F(Sessions, OfAFewNeedlesAtAnotherDepthSaysWhichAndNotThatAllScatter) {
  for (std::size_t n = 0; n < plan.needles.size(); ++n) {
    if (n == 4) continue;  // and one skipped
    implant(n, n < 2 ? Vec3(0, 0, -8) : Vec3::Zero());
  }
  EXPECT_TRUE(says("2 needles too shallow: E5 by 8.0 mm, G5 by 8.0 mm"));
  EXPECT_TRUE(says("1 needle left no seed in place: G9; 3 seeds missing"));
  EXPECT_EQ(findings().size(), 2u);
}

TEST_F(Sessions, OfOneNeedleFarTooDeepSaysSo) {
  for (std::size_t n = 0; n < plan.needles.size(); ++n) implant(n, Vec3(0, 0, n == 7 ? 30 : 0));
  EXPECT_TRUE(says("1 needle too deep: J7 by 30.0 mm"));
  EXPECT_EQ(findings().size(), 1u);
}

TEST_F(Sessions, OfAShiftThatBringsSeedsToOthersPlacesSaysNoneMissing) {
  implant_all_but(kNone, {0, 0, -10});  // a seed's distance and a spacer
  ASSERT_EQ(findings().size(), 1u);
  EXPECT_TRUE(says("all needles too shallow: the seeds fell 10.0 mm short"));
}

TEST_F(Sessions, ASeedAwayFromTheOthersOfItsNeedleIsToldAsSuch) {
  implant_all_but(4);
  implant(4, Vec3::Zero(), 1);
  drop(14, {0, 0, -25});
  EXPECT_TRUE(says("needle G9: 1 of its 3 seeds fell away from where it was planned"));
  EXPECT_EQ(findings().size(), 1u);
}

// One by one, each needle brings back less than its part of all.
TEST_F(Sessions, WithoutAnySeedTheCostIsAllOfTheDose) {
  for (std::size_t n = 0; n < plan.needles.size(); ++n) implant(n, Vec3::Zero(), 3);
  const auto found = findings();
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found[0].text.starts_with("9 needles left no seed in place")) << found[0].text;
  ImplantDose as_planned(structures, {.spacing_mm = 4, .margin_mm = 2, .source = {}});
  for (const PlannedSeed& seed : planned) as_planned.add(seed);
  char d90[32];
  std::snprintf(d90, sizeof d90, "D90 -%.1f Gy", as_planned.evaluate()[0].d90_gy);
  EXPECT_NE(found[0].text.find(d90), std::string::npos) << found[0].text << ", not " << d90;
}

TEST_F(Sessions, TheUrethraPiercedThreeTimesComesFirst) {
  implant_all_but(kNone);
  const double before_s = poses.back().t_s;
  puncture(*kGrid.position("G7"), 0);
  const double after_s = poses.back().t_s;
  for (int i = 0; i < 2; ++i) puncture(*kGrid.position("G7"), 0);
  const auto found = findings();
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found[0].at_s > before_s && found[0].at_s < after_s) << found[0].at_s.value_or(-1);
  EXPECT_NE(found[0].text.find("the urethra was entered 3 times (hole G7)"), std::string::npos)
      << found[0].text;
}

// Off by half a hole in x and in y: it went nowhere else, and certainly not through its own hole.
TEST_F(Sessions, ANeedleBetweenHolesIsNotSwappedWithItself) {
  implant_all_but(4);
  implant(4, {2.4, 2.4, 0});
  EXPECT_TRUE(says("needle G9 went aside: its 3 seeds lie 3.4 mm aside (x +2.4, y +2.4)"));
  EXPECT_EQ(findings().size(), 1u);
}

TEST_F(Sessions, ATurnedTemplateIsOneMistake) {
  for (std::size_t n = 0; n < plan.needles.size(); ++n) {
    const Vec3 tip = plan.planned_tip(kGrid, n);
    const double angle = 8 / 57.29578;
    implant(n, Vec3(std::cos(angle) * tip.x() - std::sin(angle) * tip.y() - tip.x(),
                    std::sin(angle) * tip.x() + std::cos(angle) * tip.y() - tip.y(), 0));
  }
  EXPECT_TRUE(says("the template was turned by 8.0° from x to y"));
  EXPECT_EQ(findings().size(), 1u);
}

TEST_F(Sessions, AMirroredImplantIsSaidToBeMirrored) {
  for (std::size_t n = 0; n < plan.needles.size(); ++n)
    implant(n, Vec3(-2 * plan.planned_tip(kGrid, n).x(), 0, 0));
  EXPECT_TRUE(says("left and right were exchanged: the whole implant is mirrored"));
  EXPECT_EQ(findings().size(), 1u);
}

TEST_F(Sessions, OfAGroupThatIsAsideNobodyElseIsNamed) {
  for (std::size_t n = 0; n < plan.needles.size(); ++n) implant(n, n < 4 ? Vec3(4, 0, 0) : Vec3::Zero());
  const auto found = findings();
  ASSERT_FALSE(found.empty());
  for (std::size_t i = 1; i < found.size(); ++i) EXPECT_EQ(found[i].cause, "goals") << found[i].text;
  EXPECT_TRUE(found[0].text.starts_with("4 needles lie 4.0 mm aside (x +4.0, y +0.0): E5, G5, I5, E8"))
      << found[0].text;
  EXPECT_EQ(found[0].needles, (std::vector<std::size_t>{0, 1, 2, 3}));
}

TEST_F(Sessions, ATrainDroppedAtHighSpeedIsNoticed) {
  implant_all_but(kNone);
  for (Seed& seed : seeds) seed.t_s = 10 * (seed.planned / 3) + (seed.planned % 3) * 0.03;  // 10 mm each
  EXPECT_TRUE(says("too fast: every needle was drawn back at up to 308 mm/s while the seeds fell"));
  EXPECT_EQ(findings().size(), 1u);
}

TEST_F(Sessions, SeedsOutsideTheGlandAreSaidToBeOutside) {
  for (std::size_t n = 0; n < plan.needles.size(); ++n) implant(n, Vec3(0, 0, n == 4 ? -60 : 0));
  EXPECT_TRUE(says("1 needle too shallow: G9 by 60.0 mm; all 3 seeds lie outside the gland"));
}

// The hand is on plan, and the tissue was elsewhere.
TEST_F(Sessions, WhatTheGlandDidIsItsOwnCause) {
  implant_all_but(kNone);
  for (Seed& seed : seeds) seed.rest.z() -= seed.planned % 3 == 0 ? 6 : 0.5;
  const auto found = findings();
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].cause, "gland_motion");
  EXPECT_TRUE(found[0].text.starts_with("the needles pushed the gland 6.0 mm towards the base"))
      << found[0].text;
}

TEST_F(Sessions, AnotherNuclidesStrengthIsTheFirstSentence) {
  plan.source = SourceModel::kTheraSeed200;
  plan.air_kerma_strength_u = 0.502;
  implant_all_but(kNone);
  const auto found = findings();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].text,
            "the plan's seeds 200 (Pd-103) have 0.502 U, and 1 to 3.6 U are customary: is it I-125's?");
  EXPECT_EQ(found[1].text,
            "the plan prescribes 145 Gy with 200 (Pd-103), and 125 Gy, or 100 with external beam, are "
            "customary: is it "
            "I-125's?");
}

// A ball-like structure: an octahedron of 6 mm, whose axis is 6/√3 mm from its faces.
TEST(StructureContact, HasPassesDepthAndTimeOfEachHole) {
  const std::vector<Structure> structures = {{"bulb", octahedron(6)}, {"far", octahedron(1)}};
  std::vector<TrajectorySample> poses;
  for (int i = 0; i <= 400; ++i) poses.push_back(straight(0.01 * i, 2, 0, -20 + 0.1 * i));  // through and out
  const auto contacts = structure_contacts(structures, kGrid, NeedleTrajectories({{0, Trajectory(poses)}}));
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].structure, "bulb");
  EXPECT_EQ(contacts[0].hole, "G7");
  EXPECT_EQ(contacts[0].passes, 1u);
  EXPECT_NEAR(contacts[0].depth_mm, 4 / std::sqrt(3.0), 1e-9);  // at (2, 0, 0)
  EXPECT_NEAR(contacts[0].time_s, 0.8, 0.02);                   // 8 mm at 10 mm/s
  EXPECT_NEAR(contacts[0].first_s, 1.6, 0.02);                  // from −20 mm to −4 mm
}

}  // namespace
}  // namespace brachy
