#include "apps/score/consequences.h"

#include <gtest/gtest.h>

#include "apps/score/axial_slices.h"
#include "apps/score/goal_results.h"
#include "core/brachytherapy/structures/phantom_structures.h"
#include "tests/apps/score/score_fixtures.h"

namespace brachy {
namespace {

using namespace test;

Plan plan_of_five() {
  Plan plan;
  plan.air_kerma_strength_u = 2;
  plan.base_plane_mm = 75;
  for (const char* hole : {"E5", "I5", "G9", "E8", "I8"}) plan.needles.push_back({hole, 0, "s-s-s"});
  return plan;
}

std::vector<Seed> as_planned(const Plan& plan) {
  std::vector<Seed> seeds;
  const std::vector<PlannedSeed> planned = plan.seeds(kGrid);
  for (std::size_t i = 0; i < planned.size(); ++i)
    seeds.push_back(seed_beside(planned[i], static_cast<std::uint32_t>(i + 1), static_cast<std::int32_t>(i),
                                Vec3::Zero(), Vec3::Zero()));
  for (Seed& seed : seeds) seed.air_kerma_strength_u = plan.air_kerma_strength_u;
  return seeds;
}

std::vector<Structure> body() {
  return {{"prostate", octahedron(30)}, {"urethra", phantom_urethra()}};
}

Consequences consequences(const Plan& plan, const std::vector<Seed>& seeds) {
  DoseSettings settings;
  settings.prescription_gy = plan.prescription_gy;
  ImplantDose planned(body(), settings), at_rest(body(), settings);
  for (const PlannedSeed& seed : plan.seeds(kGrid)) planned.add(seed);
  for (const Seed& seed : seeds) at_rest.add(seed.at_rest());
  return find_consequences(NeedleCosts(plan, kGrid, at_rest, seeds), plan, at_rest, planned.evaluate());
}

TEST(Consequences, AnImplantAsPlannedCostsNothing) {
  const Plan plan = plan_of_five();
  const Consequences c = consequences(plan, as_planned(plan));
  EXPECT_NEAR(c.whole.harm_percent(145), 0, 1e-3);
  ASSERT_EQ(c.needles.size(), 5u);
  for (const NeedleCost& needle : c.needles) EXPECT_NEAR(needle.change.harm_percent(145), 0, 0.02);
}

// The same as a dose of its own for the implant with that needle put right.
TEST(Consequences, ANeedlesCostIsTheImplantAgainstTheSameWithThatNeedleAsPlanned) {
  const Plan plan = plan_of_five();
  std::vector<Seed> seeds = as_planned(plan);
  for (std::size_t i = 3; i < 6; ++i) seeds[i].rest += Vec3(0, 0, -15);  // the second needle
  for (std::size_t i = 6; i < 9; ++i) seeds[i].rest += Vec3(4, 0, 0);    // the third
  const Consequences c = consequences(plan, seeds);

  DoseSettings settings;
  settings.prescription_gy = plan.prescription_gy;
  ImplantDose is(body(), settings), corrected(body(), settings);
  const std::vector<PlannedSeed> planned = plan.seeds(kGrid);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    is.add(seeds[i].at_rest());
    if (i >= 3 && i < 6)
      corrected.add(planned[i]);
    else
      corrected.add(seeds[i].at_rest());
  }
  const double expected = is.evaluate()[0].v100_percent - corrected.evaluate()[0].v100_percent;
  EXPECT_LT(expected, -0.5);
  EXPECT_NEAR(c.needles[1].change.v100_percent, expected, 0.01);
  EXPECT_NEAR(c.needles[0].change.v100_percent, 0, 0.01);
  EXPECT_GT(std::abs(c.needles[2].change.v100_percent), 0.05);
}

TEST(Consequences, ASectorWithoutSeedsIsColdAndNamed) {
  const Plan plan = plan_of_five();
  std::vector<Seed> seeds = as_planned(plan);
  // None on the patient's right, x > 0.
  std::erase_if(seeds, [](const Seed& seed) { return seed.rest.x() > 1; });
  const Consequences c = consequences(plan, seeds);
  ASSERT_EQ(c.sectors.size(), 12u);
  double left = 0, right = 0, volume = 0;
  for (const Sector& sector : c.sectors) {
    volume += sector.volume_cc;
    (sector.name.ends_with("left") ? left : right) += sector.cold_cc;
    if (sector.name.ends_with("right")) {
      EXPECT_GE(sector.coldest.x(), -1) << sector.name;
    }
  }
  EXPECT_NEAR(volume, 4.0 / 3 * 27, 0.5);  // of the octahedron
  EXPECT_GT(right, left);
}

TEST(Consequences, TheUrethrasHottestPlaceIsByTheSeedNextToIt) {
  const Plan plan = plan_of_five();
  std::vector<Seed> seeds = as_planned(plan);
  seeds[0].rest = seeds[0].dropped = Vec3(2, -4, -3);
  const Consequences c = consequences(plan, seeds);
  ASSERT_TRUE(c.urethra);
  EXPECT_LT((c.urethra->at - seeds[0].rest).norm(), 2);
  EXPECT_GT(c.urethra->over_150_cc, 0);
}

TEST(AxialSlices, CutTheGlandEveryFiveMillimetresAndOneSeedsIsodosesAreRound) {
  const std::vector<Structure> structures = body();
  DoseSettings settings;
  ImplantDose dose(structures, settings);
  DoseSeed seed{Vec3::Zero(), Vec3::UnitZ(), SourceModel::kAmersham6711, 5};
  dose.add(seed);
  const auto slices = axial_slices(structures, dose.grid(), 145);
  EXPECT_EQ(slices.size(), 13u);  // −30, −25, … 30
  const auto middle =
      std::ranges::find_if(slices, [](const AxialSlice& s) { return std::abs(s.z_mm) < 0.6; });
  ASSERT_NE(middle, slices.end());
  EXPECT_EQ(middle->structures.front().name, "prostate");
  double least = 1e9, most = 0;
  for (const auto& piece : middle->isodoses[1]) {
    const double r = std::hypot(piece[0], piece[1]);
    least = std::min(least, r);
    most = std::max(most, r);
  }
  EXPECT_GT(least, 3);
  EXPECT_LT(most - least, 0.5);
  double last = 1e9;
  for (const OutlinePieces& level : middle->isodoses) {  // hotter ones lie further in
    double r = 0;
    for (const auto& piece : level) r = std::max(r, std::hypot(piece[0], piece[1]));
    EXPECT_LT(r, last);
    last = r;
  }
}

TEST(Goals, OfPlanAndImplantAreJudgedApartAndTheVerdictNamesWhatIsMissed) {
  DoseScore dose;
  dose.prescription_gy = 145;
  StructureDose good, bad;
  good.name = bad.name = "prostate";
  good.v100_percent = 97;
  bad.v100_percent = 85;
  good.d90_gy = 160;
  bad.d90_gy = 120;
  dose.plan.structures = {good};
  dose.rest.structures = {bad};
  const auto results = judge({{"prostate", "V100", "plan", "above", 95, "A"},
                              {"prostate", "V100", "implant", "above", 90, "A"},
                              {"prostate", "D90", "implant", "above", 90, "A"},
                              {"bladder", "D2cc", "implant", "below", 100, "A"}},
                             dose);
  ASSERT_EQ(results.size(), 4u);
  EXPECT_TRUE(results[0].is_met.value());
  EXPECT_FALSE(results[1].is_met.value());
  EXPECT_FALSE(results[2].is_met.value());
  EXPECT_NEAR(results[2].limit, 130.5, 1e-9);  // 90 % of 145 Gy
  EXPECT_FALSE(results[3].is_met.has_value());
  EXPECT_EQ(verdict(results),
            "the plan meets its 1 goals; the implant misses 2 of its 2 goals: prostate V100, prostate D90");
  EXPECT_EQ(missed_text(results[1]), "prostate V100 85.0 %, under its limit of 90");
}

TEST(Goals, TheDefaultRuleSetNamesItsSourcesAndKnownFigures) {
  for (const DoseGoal& goal : default_dose_goals()) {
    EXPECT_NE(find_dose_index(goal.figure), nullptr) << goal.figure;
    EXPECT_FALSE(goal.source.empty()) << goal.figure;
  }
}

}  // namespace
}  // namespace brachy
