#include "core/brachytherapy/plan/plan_generator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/data_dir.h"

namespace brachy {
namespace {

using namespace test;

struct Planned {
  Scene scene;
  std::vector<Structure> structures;
  Plan plan;
};

Planned plan_for(const std::string& scene_text) {
  Planned all{parse_scene(scene_text, "scene.toml"), {}, {}};
  all.structures = load_structures(all.scene);
  all.plan = generate_plan(all.structures, all.scene.template_grid,
                           {"test", all.scene.seeds.source, all.scene.dose.prescription_gy, 200,
                            static_cast<std::size_t>(all.scene.seeds.max_count)});
  return all;
}

const Planned& for_the_phantom() {
  static const Planned planned = plan_for("");
  return planned;
}

/// Exact doses at random points of a structure, as shares of the prescription, decreasing.
std::vector<double> random_doses(const Planned& p, const char* structure, std::size_t count) {
  const SurfaceBvh surface(find_structure(p.structures, structure)->mesh);
  const auto planned = p.plan.seeds(p.scene.template_grid);
  const std::vector<DoseSeed> seeds(planned.begin(), planned.end());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<double> doses;
  while (doses.size() < count) {
    const Vec3 place(share(random), share(random), share(random));
    const Vec3 point = surface.min() + place.cwiseProduct(surface.max() - surface.min());
    if (surface.inside(point)) doses.push_back(total_dose_gy(seeds, point) / p.plan.prescription_gy);
  }
  std::ranges::sort(doses, std::greater());
  return doses;
}

double percent_above(const std::vector<double>& doses, double least) {
  return 100 * static_cast<double>(std::ranges::count_if(doses, [&](double d) { return d >= least; })) /
         static_cast<double>(doses.size());
}

double total_strength_u(const Plan& plan) {
  return static_cast<double>(plan.seed_count()) * plan.air_kerma_strength_u;
}

/// 2.15 d², d the mean dimension in cm (core/DESIGN.md, section 6).
double customary_strength_u(const Planned& p) {
  const SurfaceBvh gland(p.structures.front().mesh);
  const double d = (gland.max() - gland.min()).sum() / 30;
  return 2.15 * d * d;
}

TEST(PlanGenerator, ThePhantomsPlanReachesItsGoalsAtRandomPoints) {
  const Planned& p = for_the_phantom();
  const auto gland = random_doses(p, "prostate", 20'000), urethra = random_doses(p, "urethra", 5'000);
  EXPECT_GT(percent_above(gland, 1), 95);
  EXPECT_LT(percent_above(gland, 1.5), 60);
  EXPECT_GT(145 * gland[gland.size() * 9 / 10], 140);      // D90
  EXPECT_LT(100 * urethra[urethra.size() * 3 / 10], 125);  // D30
  const auto rectum = random_doses(p, "rectum", 5'000);
  EXPECT_LT(percent_above(rectum, 1) / 100 * 43, 1);  // cm³ of 43
}

TEST(PlanGenerator, ThePhantomsPlanIsOfClinicalSize) {
  const Planned& p = for_the_phantom();
  EXPECT_GE(p.plan.needles.size(), 16u);
  EXPECT_LE(p.plan.needles.size(), 24u);
  EXPECT_GE(p.plan.seed_count(), 70u);
  EXPECT_LE(p.plan.seed_count(), 90u);
  EXPECT_GT(p.plan.air_kerma_strength_u, 0.4);
  EXPECT_LT(p.plan.air_kerma_strength_u, 0.6);
  EXPECT_GT(total_strength_u(p.plan), 0.65 * customary_strength_u(p));
  EXPECT_LT(total_strength_u(p.plan), 1.15 * customary_strength_u(p));
}

TEST(PlanGenerator, NeedlesKeepOffTheUrethraAndApartAndSeedsLieInTheGland) {
  const Planned& p = for_the_phantom();
  const SurfaceBvh gland(p.structures[0].mesh), urethra(p.structures[1].mesh);
  for (std::size_t n = 0; n < p.plan.needles.size(); ++n) {
    const Vec3 tip = p.plan.planned_tip(p.scene.template_grid, n);
    EXPECT_LT(gland.closest_point(tip).signed_distance, 0.5);
    for (double z = -22; z < tip.z(); z += 1)
      EXPECT_GT(urethra.closest_point({tip.x(), tip.y(), z}).signed_distance, 4.5);
    for (std::size_t other = 0; other < n; ++other)
      EXPECT_GE((tip - p.plan.planned_tip(p.scene.template_grid, other)).head<2>().norm(), 7);
  }
  for (const PlannedSeed& seed : p.plan.seeds(p.scene.template_grid))
    EXPECT_TRUE(gland.inside(seed.position));
}

TEST(PlanGenerator, TheRimIsLoadedMoreThanTheInterior) {
  const Planned& p = for_the_phantom();
  const auto holes = find_gland_holes(p.structures, p.scene.template_grid);
  int rim_needles = 0, interior_needles = 0;
  for (const PlanNeedle& needle : p.plan.needles) {
    const auto hole = std::ranges::find(holes, needle.hole, &GlandHole::name);
    ASSERT_NE(hole, holes.end());
    const double way = hole->far_mm - hole->near_mm;
    const double seeds_per_cm = 10 * static_cast<double>(needle.seed_offsets_mm().size()) / way;
    if (hole->depth_mm < LoadingRule::kRimDepth) {
      EXPECT_GT(seeds_per_cm, 1.2) << needle.hole;
      EXPECT_EQ(needle.train.find("--"), std::string::npos) << needle.hole;  // spread evenly
      ++rim_needles;
    } else {
      EXPECT_LT(seeds_per_cm, 1.2) << needle.hole;
      EXPECT_NE(needle.train.find("--"), std::string::npos) << needle.hole;  // at the ends
      ++interior_needles;
    }
  }
  EXPECT_GT(rim_needles, interior_needles);
}

TEST(PlanGenerator, DoseIsScaledToThePrescriptionByStrengthAlone) {
  const Planned half = plan_for("[dose]\nprescription_gy = 72.5");
  const Plan& whole = for_the_phantom().plan;
  EXPECT_EQ(half.plan.needles, whole.needles);
  EXPECT_EQ(half.plan.prescription_gy, 72.5);
  EXPECT_NEAR(half.plan.air_kerma_strength_u, 0.5 * whole.air_kerma_strength_u, 1e-3);
}

TEST(PlanGenerator, PalladiumNeedsStrongerSeeds) {
  const Planned p = plan_for("[seeds]\nsource = \"200\"\n[dose]\nprescription_gy = 125");
  EXPECT_EQ(p.plan.source, SourceModel::kTheraSeed200);
  EXPECT_GT(p.plan.air_kerma_strength_u, 1.2);
  EXPECT_GT(percent_above(random_doses(p, "prostate", 5'000), 1), 95);
}

TEST(PlanGenerator, GivesTheSamePlanAgainAndOneThatLoads) {
  const Planned& p = for_the_phantom();
  EXPECT_EQ(plan_for("").plan, p.plan);
  EXPECT_EQ(parse_plan_toml(to_toml(p.plan, p.scene.template_grid), "plan.toml", p.scene.template_grid, 200),
            p.plan);
}

TEST(PlanGenerator, SmallAndLargePhantomsReachTheGoalsToo) {
  for (const char* size : {"[35, 28, 32]", "[40, 32, 36]", "[70, 55, 60]"}) {
    const Planned p = plan_for(std::string("[tissue]\nphantom_size_mm = ") + size);
    const auto gland = random_doses(p, "prostate", 5'000), urethra = random_doses(p, "urethra", 3'000);
    EXPECT_GT(percent_above(gland, 1), 95) << size;
    EXPECT_LT(percent_above(gland, 1.5), 60) << size;
    EXPECT_LT(100 * urethra[urethra.size() * 3 / 10], 125) << size;
    EXPECT_GT(total_strength_u(p.plan), 0.65 * customary_strength_u(p)) << size;
    EXPECT_LT(total_strength_u(p.plan), 1.15 * customary_strength_u(p)) << size;
  }
}

TEST(PlanGenerator, NoPlanHasMoreSeedsThanTheSceneTakes) {
  const Planned p = plan_for("[seeds]\nmax_count = 72");
  EXPECT_LE(p.plan.seed_count(), 72u);
  EXPECT_EQ(user_error([] { plan_for("[seeds]\nmax_count = 30"); }),
            "the gland needs at least 53 seeds, the scene allows 30; raise seeds.max_count");
}

TEST(PlanGenerator, RealGlandsReachTheGoalsWithoutAUrethraToSpare) {
  BRACHY_REQUIRE_DATA(data);
  const std::string folder = (data / "meshes").string();
  const std::string moved = "[template]\norigin_mm = [-29, -97, -59]\n";
  for (const std::string& scene : {"[tissue]\nmesh = \"" + folder + "/prostate_with_debris.stl\"\n",
                                   "[tissue]\nmesh = \"" + folder + "/prostate_mr.ply\"\n" + moved}) {
    const Planned p = plan_for(scene);
    const auto gland = random_doses(p, "prostate", 5'000);
    EXPECT_GT(percent_above(gland, 1), 95);
    EXPECT_LT(percent_above(gland, 1.5), 60);
    EXPECT_GT(total_strength_u(p.plan), 0.65 * customary_strength_u(p));
    EXPECT_LT(total_strength_u(p.plan), 1.15 * customary_strength_u(p));
    EXPECT_GE(p.plan.needles.size(), 10u);
  }
}

TEST(PlanGenerator, ATemplateThatDoesNotFaceTheGlandIsRefusedWithWhereItShouldBe) {
  const std::string beside = user_error([] { plan_for("[template]\norigin_mm = [100, -30, -60]"); });
  EXPECT_EQ(beside,
            "the template is beside the gland: no needle would reach it; set template.origin_mm = [-30, -30, "
            "-63]");
  EXPECT_NO_THROW(plan_for("[template]\norigin_mm = [-30, -30, -63]"));
  EXPECT_EQ(user_error([] {
              plan_for("[template]\norigin_mm = [-30, -30, 0]");
            }).find("the template is not in front of the gland; set template.origin_mm = [-30, -30, -63]"),
            0u);
  EXPECT_NE(user_error([] {
              plan_for("[template]\norigin_mm = [-30, -30, -190]");
            }).find("the needle 200 mm long; raise the z of template.origin_mm"),
            std::string::npos);
  EXPECT_NE(user_error([] { plan_for("[template]\norigin_mm = [0, 0, -60]\ncolumns = 1\nrows = 1"); })
                .find("no hole of the template has a path through the gland that is long enough and clears "
                      "the urethra"),
            std::string::npos);
}

}  // namespace
}  // namespace brachy
