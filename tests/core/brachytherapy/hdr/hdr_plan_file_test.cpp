#include "core/brachytherapy/hdr/hdr_plan_file.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

const std::string kHead =
    "kind = \"hdr\"\nname = \"p\"\nsource = \"mhdr-v2\"\nsource_strength_u = 40000\nprescription_gy = 15\n"
    "step_mm = 2.5\ntip_offset_mm = 6\n";

std::string refusal_of_hdr(const std::string& text) {
  try {
    parse_hdr_plan(text, "plan.toml", {}, 200);
  } catch (const UserError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(HdrPlanFile, IsReadAsItSaysAndWrittenAsItIsRead) {
  const HdrPlan plan = parse_hdr_plan(
      kHead + "[[catheter]]\nhole = \"D4\"\ntip_mm = 80\ndwell_s = [1, 0, 2.5]\n", "p", {}, 200);
  EXPECT_EQ(plan.catheters, (std::vector<PlanCatheter>{{"D4", 80, {1, 0, 2.5}}}));
  EXPECT_EQ(plan.source, SourceModel::kMicroSelectronV2);
  EXPECT_EQ(plan.dwell_count(), 2u);
  EXPECT_EQ(plan.total_s(), 3.5);
  const std::vector<Dwell> dwells = plan.dwells({});
  ASSERT_EQ(dwells.size(), 3u);
  EXPECT_EQ(dwells[2].position, Vec3(-15, -15, -60 + 80 - 11));
  EXPECT_EQ(parse_hdr_plan(to_toml(plan, {}), "p", {}, 200), plan);
  EXPECT_TRUE(is_hdr_plan(to_toml(plan, {})));
  EXPECT_FALSE(is_hdr_plan("name = \"p\""));
}

TEST(HdrPlanFile, WhatMakesNoSenseIsRefusedWithItsLineAndTheFix) {
  const std::string one = "[[catheter]]\nhole = \"D4\"\ntip_mm = 80\ndwell_s = [1]\n";
  EXPECT_EQ(refusal_of_hdr(kHead + one + one),
            "plan.toml:13: 'catheter.hole' is \"D4\" for the second time; use each hole once");
  EXPECT_EQ(refusal_of_hdr(kHead + "[[catheter]]\nhole = \"Z4\"\ntip_mm = 80\ndwell_s = [1]\n"),
            "plan.toml:9: 'catheter.hole' is \"Z4\"; the template has A1 … M13");
  EXPECT_EQ(refusal_of_hdr(kHead + "[[catheter]]\nhole = \"D4\"\ntip_mm = 7\ndwell_s = [1, 1]\n"),
            "plan.toml:11: 'catheter.dwell_s' reaches 8.5 mm behind the tip, which is 7 mm beyond the "
            "template; give "
            "fewer times");
  EXPECT_EQ(refusal_of_hdr(kHead + "[[catheter]]\nhole = \"D4\"\ntip_mm = 201\ndwell_s = [1]\n"),
            "plan.toml:10: 'catheter.tip_mm' is 201 and the needle is 200 mm long; lower it");
  EXPECT_EQ(refusal_of_hdr(kHead + "[[catheter]]\nhole = \"D4\"\ntip_mm = 80\ndwell_s = [0]\n"),
            "plan.toml:8: 'catheter' has no dwell time above 0; give one");
  // Sources that other tests of this process have loaded are named too.
  const std::string refusal = refusal_of_hdr("kind = \"hdr\"\nsource = \"6711\"\n");
  EXPECT_TRUE(
      refusal.starts_with("plan.toml:2: 'source' is \"6711\"; it must be one of: mhdr-v2, gammamed-hdr"))
      << refusal;
  EXPECT_TRUE(refusal.ends_with("; a scene's dose.source adds one")) << refusal;
}

// 1 U for an hour gives, 1 cm beside the source, its dose-rate constant.
TEST(HdrPlan, ADwellGivesItsDoseRateTimesItsTime) {
  const Dwell dwell{0, 0, Vec3(1, 2, 3), Vec3::UnitY(), 1800};
  const DoseSeed seed = as_seed(dwell, SourceModel::kMicroSelectronV2, 40000);
  EXPECT_NEAR(total_dose_gy(std::span(&seed, 1), Vec3(11, 2, 3)),
              0.01 * 40000 * 0.5 * tg43_source(SourceModel::kMicroSelectronV2).dose_rate_constant, 1e-9);
}

}  // namespace
}  // namespace brachy
