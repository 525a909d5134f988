#include "apps/score/dose_score.h"

#include <gtest/gtest.h>

#include <cmath>

#include "apps/score/spread.h"
#include "core/simulation/body_settings.h"
#include "tests/apps/score/score_fixtures.h"

namespace brachy {
namespace {

using namespace test;

const DoseSettings kSettings{.prescription_gy = 145, .spacing_mm = 1, .margin_mm = 5, .source = {}};

/// Strong enough that part of the small prostate receives its prescription.
Plan strong_plan() {
  Plan plan = small_plan();
  plan.air_kerma_strength_u = 4;
  return plan;
}

std::vector<Seed> dropped_as_planned(const Plan& plan) {
  std::vector<Seed> seeds;
  for (const PlannedSeed& planned : plan.seeds(kGrid)) {
    const auto index = static_cast<std::int32_t>(seeds.size());
    seeds.push_back(
        seed_beside(planned, static_cast<std::uint32_t>(index) + 1, index, Vec3::Zero(), Vec3::Zero()));
  }
  return seeds;
}

/// A prostate about the planned seeds of D4 and F6.
std::vector<Structure> prostate_only() {
  SurfaceMesh mesh = octahedron(15);
  for (Vec3& v : mesh.vertices) v += Vec3(-12, -12, 8);
  return {{"prostate", std::move(mesh)}};
}

const DoseFigure& figure_named(const char* structure, const char* name) {
  for (const DoseFigure& f : dose_figures())
    if (f.structure == std::string_view(structure) && f.name == std::string_view(name)) return f;
  throw std::out_of_range(name);
}

TEST(DoseScore, SeedsWhereTheyWerePlannedGiveThePlansDose) {
  const Plan plan = strong_plan();
  const std::vector<Seed> seeds = dropped_as_planned(plan);
  const DoseScore score = score_dose(plan, kGrid, prostate_only(), kSettings, &seeds);
  EXPECT_EQ(score.plan.seeds, 3u);
  ASSERT_EQ(score.plan.structures.size(), 1u);
  EXPECT_GT(score.plan.structures[0].v100_percent, 10);
  for (const DoseStage* stage : {&score.dropped, &score.rest}) {
    ASSERT_EQ(stage->structures.size(), 1u);
    EXPECT_EQ(stage->structures[0].volume_share, score.plan.structures[0].volume_share);
    EXPECT_EQ(stage->structures[0].d90_gy, score.plan.structures[0].d90_gy);
  }
}

TEST(DoseScore, AsDroppedAndAtRestAreToldApart) {
  const Plan plan = strong_plan();
  std::vector<Seed> seeds = dropped_as_planned(plan);
  for (Seed& seed : seeds) seed.rest += Vec3(200, 0, 0);  // out of the gland
  const DoseScore score = score_dose(plan, kGrid, prostate_only(), kSettings, &seeds);
  EXPECT_EQ(score.dropped.structures[0].d90_gy, score.plan.structures[0].d90_gy);
  EXPECT_EQ(score.rest.structures[0].v100_percent, 0);
  EXPECT_LT(score.rest.structures[0].d90_gy, 0.2 * score.plan.structures[0].d90_gy);
}

TEST(DoseScore, DoseIsInThePlansPrescription) {
  Plan plan = strong_plan();
  const std::vector<Seed> seeds = dropped_as_planned(plan);
  const double v100 =
      score_dose(plan, kGrid, prostate_only(), kSettings, &seeds).plan.structures[0].v100_percent;
  plan.prescription_gy = 72.5;
  const DoseScore half = score_dose(plan, kGrid, prostate_only(), kSettings, &seeds);
  EXPECT_EQ(half.prescription_gy, 72.5);
  EXPECT_NEAR(half.plan.structures[0].v200_percent, v100, 0.1);
}

TEST(DoseScore, WithoutSeedsOnlyThePlansDoseIsKnown) {
  const DoseScore score = score_dose(strong_plan(), kGrid, prostate_only(), kSettings, nullptr);
  EXPECT_EQ(score.plan.structures.size(), 1u);
  EXPECT_TRUE(score.rest.structures.empty());
  const DoseFigure& d90 = figure_named("prostate", "D90");
  EXPECT_GT(figure_of(score.plan, d90), 0);
  EXPECT_TRUE(std::isnan(figure_of(score.rest, d90)));
  EXPECT_TRUE(std::isnan(figure_of(score.plan, figure_named("urethra", "D30"))));  // the scene has none
}

TEST(DoseScore, OnDayZeroSeedsAndTissueLieAsFarApartAsInASwollenGland) {
  const Plan plan = strong_plan();
  const std::vector<Seed> seeds = dropped_as_planned(plan);
  const DoseScore score = score_dose(plan, kGrid, prostate_only(), kSettings, &seeds);
  // The same by hand: gland and seeds stretched, and the dose in them as they are then.
  const Vec3 stretch = SwellingSettings::kDayZero;
  std::vector<Structure> swollen = prostate_only();
  for (Vec3& v : swollen.front().mesh.vertices) v = v.cwiseProduct(stretch);
  DoseSettings fine = kSettings;
  fine.spacing_mm = 0.5;
  ImplantDose dose(swollen, fine);
  for (const Seed& seed : seeds) {
    DoseSeed moved = seed.at_rest();
    moved.position = moved.position.cwiseProduct(stretch);
    dose.add(moved);
  }
  const StructureDose by_hand = dose.evaluate().front();
  ASSERT_EQ(score.day_zero.structures.size(), 1u);
  EXPECT_NEAR(score.day_zero.structures[0].d90_gy, by_hand.d90_gy, 0.01 * by_hand.d90_gy);
  EXPECT_NEAR(score.day_zero.structures[0].v100_percent, by_hand.v100_percent, 0.5);
  EXPECT_LT(score.day_zero.structures[0].d90_gy, 0.95 * score.rest.structures[0].d90_gy);
}

}  // namespace
}  // namespace brachy
