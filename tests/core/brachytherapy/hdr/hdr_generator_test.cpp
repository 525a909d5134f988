#include "core/brachytherapy/hdr/hdr_generator.h"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/hdr/dwell_doses.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/tissue/interior_points.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

/// The default phantom's plan, made once.
struct PhantomPlan {
  std::vector<Structure> structures = load_structures(Scene());
  TemplateGrid grid;
  HdrPlan plan = generate_hdr_plan(structures, grid, {.name = "test", .implant = {}});

  static const PhantomPlan& get() {
    static const PhantomPlan all;
    return all;
  }
};

TEST(HdrGenerator, MeetsItsGoalsOnTheDefaultPhantomByTheDoseGrid) {
  const PhantomPlan& p = PhantomPlan::get();
  EXPECT_GE(p.plan.catheters.size(), 16u);
  EXPECT_LE(p.plan.catheters.size(), 20u);
  DoseSettings settings;
  settings.prescription_gy = p.plan.prescription_gy;
  ImplantDose dose(p.structures, settings);
  for (const DoseSeed& seed : as_seeds(p.plan.dwells(p.grid), p.plan.source, p.plan.source_strength_u))
    dose.add(seed);
  const std::vector<StructureDose> of = dose.evaluate();
  EXPECT_GE(of[0].v100_percent, HdrGoals::kLeastV100);
  EXPECT_LE(of[0].v150_percent, HdrGoals::kMostV150);
  EXPECT_LE(of[1].d10_gy, HdrGoals::kMostUrethraD10 / 100 * p.plan.prescription_gy);
  EXPECT_LE(of[2].d2cc_gy, HdrGoals::kMostD2cc / 100 * p.plan.prescription_gy);
  EXPECT_GT(of[1].d0_1cc_gy, of[1].d10_gy);
}

// Points that the optimiser did not have, and the exact sum.
TEST(HdrGenerator, MeetsItsGoalsByExactSumsAtOtherPoints) {
  const PhantomPlan& p = PhantomPlan::get();
  const auto seeds = as_seeds(p.plan.dwells(p.grid), p.plan.source, p.plan.source_strength_u);
  double above = 0, high = 0;
  const auto points = fill_interior(SurfaceBvh(p.structures[0].mesh), 5000, 7);
  for (const Vec3& x : points) {
    const double share = total_dose_gy(seeds, x) / p.plan.prescription_gy;
    above += share >= 1;
    high += share >= 1.5;
  }
  EXPECT_GE(100 * above / 5000, HdrGoals::kLeastV100);
  EXPECT_LE(100 * high / 5000, HdrGoals::kMostV150);
}

TEST(HdrGenerator, MakesTheSamePlanAgain) {
  const PhantomPlan& p = PhantomPlan::get();
  EXPECT_EQ(generate_hdr_plan(p.structures, p.grid, {.name = "test", .implant = {}}), p.plan);
}

TEST(HdrGenerator, KeepsWithinTheNumberOfCathetersItIsGiven) {
  const PhantomPlan& p = PhantomPlan::get();
  ImplantSettings implant;
  implant.max_catheters = 7;
  implant.step_mm = 2.5;
  const HdrPlan few = generate_hdr_plan(p.structures, p.grid, {.name = "few", .implant = implant});
  EXPECT_LE(few.catheters.size(), 7u);
  EXPECT_EQ(few.step_mm, 2.5);
}

TEST(HdrGenerator, WritesWhatTheLoaderReads) {
  const PhantomPlan& p = PhantomPlan::get();
  EXPECT_EQ(parse_hdr_plan(to_toml(p.plan, p.grid), "again", p.grid, 200), p.plan);
}

TEST(HdrGenerator, RefusesANeedleThatDoesNotReachTheBase) {
  const PhantomPlan& p = PhantomPlan::get();
  HdrPlanSettings settings{.name = "short", .implant = {}};
  settings.needle_length_mm = 60;
  try {
    generate_hdr_plan(p.structures, p.grid, settings);
    FAIL() << "accepted";
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("raise the z of template.origin_mm"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace brachy
