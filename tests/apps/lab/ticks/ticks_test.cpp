// `brachy ticks` end to end, and how it reads a large motion; times are not tested.
#include <set>

#include "apps/lab/ticks/large_motion.h"
#include "apps/lab/ticks/tick_errors.h"
#include "tests/apps/lab/reference_run.h"

namespace brachy {
namespace {

using namespace test;
using Json = nlohmann::json;

TEST(LargeMotions, LandmarksMoveInProportionToTheLevel) {
  const LargeMotion motion = load_large_motion(kLargeMotions / "drag");
  ASSERT_EQ(motion.levels.size(), 4u);
  ASSERT_EQ(motion.landmarks.size(), 13u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(motion.levels[k].motion_mm, 2.0 * double(k + 1));
    EXPECT_EQ(motion.levels[k].field.size(), 1500u);
    for (const Vec3& d : motion.levels[k].displacements)
      EXPECT_LT((d - motion.levels[k].motion_mm * Vec3::UnitZ()).norm(), 1e-12);
  }
}

TEST(LargeMotions, AContactIsOneLandmarkByTheLawAndASphereSixWithItsCore) {
  const LargeMotion law = load_large_motion(kLargeMotions / "indentation");
  ASSERT_EQ(law.landmarks.size(), 1u);
  EXPECT_EQ(law.levels.back().motion_mm, 7.5);
  EXPECT_NEAR(law.levels.back().spreads[0].stiffness_n_per_mm, 0.3 + 0.06 * 7.5, 1e-12);
  const LargeMotion sphere = load_large_motion(kLargeMotions / "sphere_4");
  ASSERT_EQ(sphere.landmarks.size(), 6u);
  for (const LandmarkSpread& spread : sphere.levels.back().spreads) EXPECT_EQ(spread.core_mm, 4);
  EXPECT_EQ(sphere.given.landmarks.size(), 3u);  // comparators have the points of the data
}

TEST(LargeMotions, ForcesOnLandmarksAreTogetherThoseOfTheReference) {
  for (const char* name : {"insertion_10", "insertion_20", "insertion_40", "withdrawal_20"}) {
    SCOPED_TRACE(name);
    const LargeMotion motion = load_large_motion(kLargeMotions / name);
    ASSERT_TRUE(motion.is_by_forces);
    const NumberTable table =
        load_number_csv(kLargeMotions / name / "forces.csv", "level,x,y,z,fx,fy,fz,core_mm");
    Vec3 stated = Vec3::Zero(), given = Vec3::Zero(), stated_moment = Vec3::Zero(),
         given_moment = Vec3::Zero();
    for (std::size_t i = 0; i < table.rows(); ++i) {
      const auto row = table.row(i);
      stated += Vec3(row[4], row[5], row[6]);
      stated_moment += row[6] * Vec3(row[1], row[2], row[3]);
    }
    const LargeMotion::Level& level = motion.levels.back();
    for (std::size_t i = 0; i < level.forces.size(); ++i) {
      given += level.forces[i];
      given_moment += level.forces[i].z() * motion.landmarks[i];
    }
    EXPECT_LT((given - stated).norm(), 1e-12);
    EXPECT_LT((given_moment - stated_moment).norm(), 1e-9);
  }
}

TEST(Ticks, EveryLevelHasARowWithItsLandmarksMet) {
  const ReferenceRun run = run_on_references({"ticks", "--models", "psi31,thin_plate_walls", "--scenes",
                                              "sphere_2,insertion_10", "--references", kReferences.string()});
  EXPECT_NE(run.table.find("| psi31 |"), std::string::npos);
  std::multiset<std::string> rows;
  for (const Json& row : run.rows) {
    const std::string model = row.at("model"), scene = row.at("scene");
    rows.insert(model + " " + scene);
    EXPECT_GT(row.at("rel_l2"), 0);
    if (row.at("in_daemon")) {
      EXPECT_LT(row.at("missed_mm"), row.at("held_mm").get<double>() + 1e-6);
      EXPECT_EQ(row.at("verdict"), "injective");
    } else {
      EXPECT_GE(row.at("evaluation_ms"), 0);
    }
  }
  EXPECT_EQ(rows.count("psi31 sphere_2"), 4u);
  EXPECT_EQ(rows.count("thin_plate_walls sphere_2"), 4u);
  EXPECT_EQ(rows.count("psi31 insertion_10"), 1u);
  EXPECT_EQ(rows.count("thin_plate_walls insertion_10"), 0u);  // a spline knows no forces
}

// More landmarks than a tick has time for, and than a scene has by default: the tissue lags by some ticks of the hand's
// way, wherever that begins, and by no more.
TEST(Ticks, TheNeedleComesToALevelAtAHandsSpeed) {
  LargeMotion crowded = load_large_motion(kLargeMotions / "two_needles");
  const auto shaft = static_cast<std::ptrdiff_t>(crowded.landmarks.size() / 2);
  for (LargeMotion::Level& level : crowded.levels) level.spreads.resize(static_cast<std::size_t>(4 * shaft));
  for (std::ptrdiff_t i = 2 * shaft; i-- > 0;) {
    const auto at = static_cast<std::size_t>(i);
    crowded.landmarks.insert(crowded.landmarks.begin() + i, crowded.landmarks[at] + Vec3(0, 0, 1.5));
    for (LargeMotion::Level& level : crowded.levels)
      level.displacements.insert(level.displacements.begin() + i, Vec3(level.displacements[at]));
  }
  const auto last_row = [](const LargeMotion& motion) {
    return measure_ticks({.name = "elastic", .kernel = "elastic"}, motion).back();
  };
  const TickRow after_others = last_row(crowded);
  ASSERT_EQ(after_others.error, "");
  EXPECT_TRUE(after_others.is_late);
  crowded.levels.erase(crowded.levels.begin(), crowded.levels.end() - 1);
  const TickRow alone = last_row(crowded);
  EXPECT_NEAR(alone.rel_l2, after_others.rel_l2, 0.02);
}

TEST(Ticks, AWayThatNoHandGoesIsAnErrorOfItsRows) {
  LargeMotion motion = load_large_motion(kLargeMotions / "indentation");
  motion.levels.back().displacements = {1e6 * Vec3::UnitZ()};
  for (const TickRow& row : measure_ticks({.name = "elastic", .kernel = "elastic"}, motion))
    EXPECT_NE(row.error.find("move by 999994 mm"), std::string::npos) << row.error;
}

TEST(Ticks, WhatThereIsNotIsRefusedByName) {
  EXPECT_TRUE(refused_in_one_line(run_brachy({"ticks", "--scenes", "drift"}), {"--scenes", "drift", "drag"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"ticks", "--models", "gel"}), {"--models", "gel", "elastic"}));
  TempFolder folder;
  EXPECT_TRUE(refused_in_one_line(run_brachy({"ticks", "--references", (folder / "no").string()}),
                                  {"large_motion", "--references"}));
}

}  // namespace
}  // namespace brachy
