#include "core/brachytherapy/plan/request/make_plan.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/plan/optimiser/load_moves.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/data_dir.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

using namespace test;

std::vector<Structure> phantom_for(const std::string& scene) {
  return load_structures(parse_scene(scene, "scene.toml"));
}

PlanRequest quick_request() {
  PlanRequest request;
  request.settings = {"test", SourceModel::kAmersham6711, 145, 200, 256};
  request.how.proposals = 4'000;
  request.how.points = {400, 48, 48, 32};
  return request;
}

std::string refusal(const std::vector<Structure>& structures, const TemplateGrid& grid,
                    const PlanRequest& request) {
  try {
    make_plan(structures, grid, request);
  } catch (const PlanRefused& e) {
    return e.what();
  }
  return "not refused";
}

TEST(MakePlan, AStrengthThatIsNotMadeIsRefusedWithTheNearestThatIs) {
  PlanRequest request = quick_request();
  request.strength_u = 2;
  const std::string strong = refusal(phantom_for(""), TemplateGrid(), request);
  EXPECT_NE(strong.find("seeds of 2 U: I-125 seeds (6711) are made of 0.25 … 0.76 U"), std::string::npos)
      << strong;
  EXPECT_NE(strong.find("the nearest is 0.76 U"), std::string::npos) << strong;
  request.strength_u = 0.1;
  EXPECT_NE(refusal(phantom_for(""), TemplateGrid(), request).find("the nearest is 0.25 U"),
            std::string::npos);
}

TEST(MakePlan, MoreSeedsThanAreAllowedIsRefusedWithTheStrengthThatWouldDo) {
  PlanRequest request = quick_request();
  request.strength_u = 0.25;
  request.how.most_seeds = 90;
  const std::string text = refusal(phantom_for(""), TemplateGrid(), request);
  EXPECT_NE(text.find("the gland of 47 cc needs at least"), std::string::npos) << text;
  EXPECT_NE(text.find("and 90 are allowed; the nearest that can be planned is --strength-u 0.4"),
            std::string::npos)
      << text;
}

/// V100 of the gland, %, and D30 of the urethra, % of the prescription.
std::pair<double, double> reached(const MadePlan& made, const TemplateGrid& grid) {
  ImplantDose dose(made.structures, DoseSettings());
  for (const PlannedSeed& seed : made.plan.seeds(grid)) dose.add(seed);
  const auto figures = dose.evaluate();
  return {figures[0].v100_percent, figures[1].d30_gy / 1.45};
}

double number_after(const std::string& text, const std::string& words) {
  const std::size_t at = text.find(words);
  return at == std::string::npos ? -1 : std::strtod(text.c_str() + at + words.size(), nullptr);
}

TEST(MakePlan, WhatARefusalAdvisesReachesTheGoals) {
  // 18 cc and few seeds, so that the test is quick.
  const auto gland = phantom_for("[tissue]\nphantom_size_mm = [36, 30, 32]");
  PlanRequest request;
  request.settings = {"test", SourceModel::kAmersham6711, 145, 200, 256};
  request.how.proposals = 150'000;
  request.strength_u = 0.3;
  request.how.most_seeds = 40;
  const std::string text = refusal(gland, TemplateGrid(), request);
  const double strength = number_after(text, "--strength-u "), seeds = number_after(text, "max_count of ");
  ASSERT_GT(strength, 0.3) << text;
  ASSERT_GT(seeds, 40) << text;
  PlanRequest stronger = request, more = request;
  stronger.strength_u = strength;
  more.how.most_seeds = static_cast<std::size_t>(seeds);
  for (const PlanRequest& advised : {stronger, more}) {
    const auto [v100, d30] = reached(make_plan(gland, TemplateGrid(), advised), TemplateGrid());
    EXPECT_GE(v100, 98) << text;
    EXPECT_LE(d30, 120) << text;
  }
}

TEST(MakePlan, WeakSeedsMayBeAsManyAsMakeUpTheCustomaryStrength) {
  PlanRequest request = quick_request();
  request.strength_u = 0.3;  // 90 of them are 27 U, and 47 cc want some 40
  request.how.proposals = 20'000;
  const MadePlan made = make_plan(phantom_for(""), TemplateGrid(), request);
  EXPECT_GT(made.plan.seed_count(), 90u);
  EXPECT_LE(made.plan.seed_count(), 146u);  // customary: 2.15 · 4.5² U
}

TEST(MakePlan, AScenesOwnGoalsConstrainThePlanAndJudgeIt) {
  const auto gland = phantom_for("[tissue]\nphantom_size_mm = [36, 30, 32]");
  PlanRequest request = quick_request();
  request.how.proposals = 60'000;
  request.how.points = {};
  const auto hot_percent = [&](const PlanRequest& asked) {
    const MadePlan made = make_plan(gland, TemplateGrid(), asked);
    ImplantDose dose(made.structures, DoseSettings());
    for (const PlannedSeed& seed : made.plan.seeds(TemplateGrid())) dose.add(seed);
    return dose.evaluate()[0].v150_percent;
  };
  const double as_usual = hot_percent(request);
  request.goals = {{"prostate", "V100", "plan", "above", 92}, {"prostate", "V150", "plan", "below", 32}};
  const double constrained = hot_percent(request);
  // Weighed against the coverage, which is not given up.
  EXPECT_LT(constrained, as_usual - 2);
  request.goals = {{"prostate", "V100", "plan", "above", 99.99}};
  request.how.most_needles = 12;
  const std::string text = refusal(gland, TemplateGrid(), request);
  EXPECT_NE(text.find("and the goal is 99.99 %; use --max-needles 25"), std::string::npos) << text;
}

TEST(MakePlan, AGlandThatTheTemplateDoesNotReachIsRefusedWithItsShare) {
  const std::string text = refusal(phantom_for("[tissue]\nphantom_size_mm = [140, 130, 150]"),
                                   TemplateGrid{13, 13, 5, {-30, -30, -100}}, quick_request());
  EXPECT_EQ(text.find("the gland has 1,4"), 0u) << text;
  EXPECT_NE(text.find(" cc; a template of 60 × 60 mm and needles of 200 mm reach "), std::string::npos)
      << text;
  EXPECT_NE(text.find("the nearest that can be planned is a gland within 76 × 76 mm"), std::string::npos)
      << text;
}

TEST(MakePlan, ALiverIsRefused) {
  BRACHY_REQUIRE_DATA(data);
  const auto liver =
      phantom_for("[tissue]\nmesh = \"" + (data / "meshes/liver_concave.ply").string() + "\"\n");
  const std::string text = refusal(liver, TemplateGrid{13, 13, 5, {-50, -70, -70}}, quick_request());
  EXPECT_NE(text.find("a template of 60 × 60 mm"), std::string::npos) << text;
}

TEST(MakePlan, APlanThatLeavesTooMuchUncoveredIsRefused) {
  PlanRequest request = quick_request();
  request.how.most_needles = 4;
  const std::string text = refusal(phantom_for(""), TemplateGrid(), request);
  EXPECT_EQ(text.find("the best plan found with 4 needles"), 0u) << text;
  EXPECT_NE(text.find("and the goal is 95 %; use --max-needles 25"), std::string::npos) << text;
}

TEST(MakePlan, WhatIsAssumedIsNotedInThePlansFile) {
  std::vector<Structure> gland = phantom_for("");
  gland.erase(gland.begin() + 1);
  PlanRequest request = quick_request();
  request.settings.source = SourceModel::kTheraSeed200;
  request.settings.prescription_gy = 125;
  request.how.proposals = 60'000;
  request.how.points = {};
  const MadePlan made = make_plan(gland, TemplateGrid(), request);
  ASSERT_EQ(made.notes.size(), 2u);
  EXPECT_EQ(made.notes[0].find("urethra assumed: the scene has none"), 0u);
  EXPECT_EQ(made.notes[1].find("strength assumed: the scene's 0.5 U is none of Pd-103 seeds"), 0u);
  EXPECT_EQ(made.plan.air_kerma_strength_u, 2.0);
  EXPECT_NE(find_structure(made.structures, "urethra"), nullptr);
  for (const std::string& text : {to_toml(made.plan, {}, made.notes), to_csv(made.plan, {}, made.notes)})
    EXPECT_NE(text.find("# Note: urethra assumed"), std::string::npos);
  EXPECT_EQ(parse_plan_toml(to_toml(made.plan, {}, made.notes), "plan", TemplateGrid(), 200), made.plan);
  EXPECT_EQ(parse_plan_csv(to_csv(made.plan, {}, made.notes), "plan", TemplateGrid(), 200), made.plan);
}

TEST(MakePlan, NeverMakesWhatTheLoaderRefuses) {
  RepeatableRandom random(26);
  const auto within = [&](double least, double most) { return least + (most - least) * random.share(); };
  SurfaceMesh unit = phantom_for("[tissue]\nphantom_surface_vertices = 200\npoints = 400").front().mesh;
  for (Vec3& v : unit.vertices) v = v.cwiseQuotient(0.5 * phantom_size());
  int made = 0, refused = 0;
  const int requests = test::scene_count(150);
  for (int k = 0; k < requests; ++k) {
    const Vec3 centre(within(-8, 8), within(-8, 8), within(-5, 5));
    SurfaceMesh gland = unit;
    const Vec3 half(within(9, 25), within(9, 22), within(9, 25));
    for (Vec3& v : gland.vertices) v = v.cwiseProduct(half) + centre;
    TemplateGrid grid;
    grid.columns = random.between(9, 20);
    grid.rows = random.between(9, 20);
    grid.spacing_mm = within(4, 7);
    grid.origin_mm =
        centre - Vec3(0.5 * grid.spacing_mm * (grid.columns - 1) + within(-4, 4),
                      0.5 * grid.spacing_mm * (grid.rows - 1) + within(-4, 4), half.z() + within(-3, 80));
    PlanRequest request;
    request.settings = {"gland " + std::to_string(k),
                        random.share() < 0.5 ? SourceModel::kAmersham6711 : SourceModel::kTheraSeed200,
                        within(60, 160), within(100, 200), static_cast<std::size_t>(random.between(40, 300))};
    request.method = k % 50 == 0 ? PlanMethod::kRule : PlanMethod::kAnnealing;
    if (random.share() < 0.2) request.strength_u = within(0.1, 4);
    request.how.seed = static_cast<std::uint64_t>(k);
    request.how.proposals = 3'000;
    request.how.points = {120, 16, 16, 16};
    request.how.chains = request.how.threads = 1;
    try {
      const MadePlan plan = make_plan({{"prostate", gland}}, grid, request);
      const double length = request.settings.needle_length_mm;
      ASSERT_EQ(parse_plan_toml(to_toml(plan.plan, grid, plan.notes), "plan", grid, length), plan.plan) << k;
      ASSERT_EQ(parse_plan_csv(to_csv(plan.plan, grid, plan.notes), "plan", grid, length), plan.plan) << k;
      ASSERT_LE(plan.plan.seed_count(), request.settings.max_seeds) << k;
      ++made;
    } catch (const PlanRefused& e) {
      EXPECT_EQ(std::string(e.what()).find("not valid"), std::string::npos) << k << ": " << e.what();
      EXPECT_EQ(std::string(e.what()).find("report this"), std::string::npos) << k << ": " << e.what();
      ++refused;
    } catch (const UserError&) {
      ++refused;
    }
  }
  EXPECT_GT(made, 2 * requests / 25);
  EXPECT_GT(refused, 3 * requests / 25);
}

TEST(MakePlan, AMarginIsPlannedForButNotTowardsTheRectum) {
  const auto structures = phantom_for("[tissue]\nphantom_size_mm = [35, 28, 32]");
  PlanRequest request = quick_request();
  request.how.proposals = 20'000;
  request.goals = {{"prostate", "V100", "plan", "above", 50}};
  const MadePlan plain = make_plan(structures, TemplateGrid(), request);
  EXPECT_EQ(find_structure(plain.structures, "target"), nullptr);
  request.margins = {.mm = 4, .posterior_mm = 0};
  const MadePlan wide = make_plan(structures, TemplateGrid(), request);
  const Structure* target = find_structure(wide.structures, "target");
  ASSERT_NE(target, nullptr);
  const SurfaceBvh gland(structures.front().mesh), around(target->mesh);
  EXPECT_NEAR(around.max().x() - gland.max().x(), 4, 0.05);
  EXPECT_NEAR(around.max().y() - gland.max().y(), 4, 0.05);
  EXPECT_NEAR(gland.min().z() - around.min().z(), 4, 0.05);
  EXPECT_NEAR(gland.min().y() - around.min().y(), 0, 0.05);
  const auto v100 = [&](const MadePlan& made) {
    ImplantDose dose({structures.front(), *target}, DoseSettings());
    for (const PlannedSeed& seed : made.plan.seeds(TemplateGrid())) dose.add(seed);
    return dose.evaluate()[1].v100_percent;
  };
  EXPECT_GT(v100(wide), v100(plain) + 5);
  ASSERT_FALSE(wide.notes.empty());
  EXPECT_NE(wide.notes.back().find("target: the gland with a margin of 4 mm, posterior 0 mm, has"),
            std::string::npos)
      << wide.notes.back();
}

TEST(MakePlan, FewestNeedlesStillMeetTheGoals) {
  const auto structures = phantom_for("[tissue]\nphantom_size_mm = [35, 28, 32]");
  PlanRequest request = quick_request();
  request.how.proposals = 20'000;
  request.goals = {{"prostate", "V100", "plan", "above", 90}};
  const MadePlan any = make_plan(structures, TemplateGrid(), request);
  request.fewest_needles = true;
  const MadePlan fewest = make_plan(structures, TemplateGrid(), request);
  EXPECT_LT(fewest.plan.needles.size(), any.plan.needles.size());
  ImplantDose dose({structures.front()}, DoseSettings());
  for (const PlannedSeed& seed : fewest.plan.seeds(TemplateGrid())) dose.add(seed);
  EXPECT_GE(dose.evaluate().front().v100_percent, 90);
  const std::string note = fewest.notes.back();
  EXPECT_EQ(
      note.find("fewest needles: " + std::to_string(fewest.plan.needles.size()) + "; with " +
                std::to_string(fewest.plan.needles.size() - 1) + " the plan found misses prostate V100"),
      0u)
      << note;
}

}  // namespace
}  // namespace brachy
