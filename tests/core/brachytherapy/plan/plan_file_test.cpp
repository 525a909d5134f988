#include "core/brachytherapy/plan/plan_file.h"
#include "core/scene/load_plan.h"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.h"
#include "core/scene/file/scene_file.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

constexpr double kNeedle = 200;
const std::string kHead =
    "source = \"6711\"\nair_kerma_strength_u = 0.5\nprescription_gy = 145\nbase_plane_mm = 80\n";
const std::string kCsvHead = std::string(kPlanCsvHeader) + "\n";

std::string needle(const std::string& hole, const std::string& train, const std::string& more = "") {
  return "[[needle]]\nhole = \"" + hole + "\"\ntrain = \"" + train + "\"\n" + more;
}

std::string toml_refusal(const std::string& text) {
  return user_error([&] { parse_plan_toml(text, "plan.toml", {}, kNeedle); });
}

std::string csv_refusal(const std::string& text) {
  return user_error([&] { parse_plan_csv(text, "plan.csv", {}, kNeedle); });
}

Plan awkward_plan(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  Plan plan;
  plan.name = "a \"quoted\" \\ name, # of größe " + std::to_string(seed);
  plan.source = seed % 2 ? SourceModel::kTheraSeed200 : SourceModel::kAmersham6711;
  plan.air_kerma_strength_u = 0.1 + share(random) / 3;
  plan.prescription_gy = 100 + 100 * share(random);
  plan.base_plane_mm = 100 + share(random);
  const TemplateGrid grid;
  for (int n = 0; n < grid.columns; ++n)
    plan.needles.push_back({grid.name(n, static_cast<int>(share(random) * grid.rows)),
                            30 * share(random) * (n % 3), n % 2 ? "s-s--s" : "-ss"});
  return plan;
}

TEST(PlanFile, TomlAndCsvReadBackBitForBit) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Plan plan = awkward_plan(seed);
    EXPECT_EQ(parse_plan_toml(to_toml(plan, {}), "plan.toml", {}, kNeedle), plan);
    EXPECT_EQ(parse_plan_csv(to_csv(plan, {}), "plan.csv", {}, kNeedle), plan);
  }
}

// Whatever a file and a scene call the holes, the needles go where they were planned.
TEST(PlanFile, HolesAreThoseOfTheFileInEveryScene) {
  const TemplateGrid plain;
  const std::vector<TemplateGrid> grids = {plain, plain.named("right", false), plain.named("left", true),
                                           plain.named("right", true)};
  for (const TemplateGrid& from : grids)
    for (const TemplateGrid& to : grids) {
      Plan plan = awkward_plan(3);
      for (PlanNeedle& n : plan.needles) n.hole = from.renamed(n.hole, plain);
      for (const Plan& read : {parse_plan_toml(to_toml(plan, from), "plan.toml", to, kNeedle),
                               parse_plan_csv(to_csv(plan, from), "plan.csv", to, kNeedle)})
        for (std::size_t n = 0; n < plan.needles.size(); ++n) {
          EXPECT_EQ(read.planned_tip(to, n), plan.planned_tip(from, n)) << plan.needles[n].hole;
          EXPECT_EQ(to.renamed(plan.needles[n].hole, from), read.needles[n].hole);
        }
    }
}

TEST(PlanFile, WithoutSayingSoAFileHasTheHolesOfTheFirstVersions) {
  const TemplateGrid clinic = TemplateGrid().named("right", true);
  EXPECT_EQ(parse_plan_toml(kHead + needle("A1", "s"), "plan.toml", clinic, kNeedle).needles[0].hole, "G1");
  EXPECT_EQ(
      parse_plan_toml("letters_from = \"right\"\n" + kHead + needle("A1", "s"), "plan.toml", clinic, kNeedle)
          .needles[0]
          .hole,
      "A1");
  EXPECT_NE(toml_refusal(kHead + needle("d4", "s")).find("half_steps"), std::string::npos);
  EXPECT_NE(toml_refusal("letters_from = \"top\"\n" + kHead + needle("D4", "s")).find("letters_from"),
            std::string::npos);
  const std::string head = std::string(kPlanCsvHeader) + ",letters_from,half_steps\n";
  EXPECT_EQ(parse_plan_csv(head + "d4.5,0,s,80,6711,0.5,145,p,right,true\n", "plan.csv", {}, kNeedle)
                .needles[0]
                .hole,
            "F8");
  EXPECT_NE(csv_refusal(head + "D4,0,s,80,6711,0.5,145,p,up,true\n").find("left or right"),
            std::string::npos);
  EXPECT_NE(csv_refusal(head + "D4,0,s,80,6711,0.5,145,p,right,maybe\n").find("true or false"),
            std::string::npos);
  EXPECT_NE(csv_refusal(head + "D4,0,s,80,6711,0.5,145,p\n").find("found 8 columns, expected 10"),
            std::string::npos);
  EXPECT_NE(csv_refusal(head + "D4,0,s,80,6711,0.5,145,p,right,true\nD5,0,s,80,6711,0.5,145,p,left,true\n")
                .find("names its hole in another way"),
            std::string::npos);
}

TEST(PlanFile, TheExtensionSaysWhatItIs) {
  const Plan plan = awkward_plan(1);
  const TempFile toml("plan.toml", to_toml(plan, {})), csv("plan.CSV", to_csv(plan, {})),
      text("plan.txt", "");
  EXPECT_EQ(load_plan(toml.path(), {}), plan);
  EXPECT_EQ(load_plan(csv.path(), {}), plan);
  EXPECT_NE(user_error([&] {
              load_plan(text.path(), {});
            }).find("unknown plan format; the name must end in .toml or .csv"),
            std::string::npos);
  EXPECT_EQ(
      user_error([] { load_plan("/nonexistent/p.toml", {}); }).find("/nonexistent/p.toml: no such plan"), 0u);
}

TEST(PlanFile, RetractionIsNoneWhereItIsNotSaidAndTheRestIsAsItSays) {
  const Plan plan = parse_plan_toml(kHead + needle("D4", "s"), "plan.toml", {}, kNeedle);
  ASSERT_EQ(plan.needles.size(), 1u);
  EXPECT_EQ(plan.needles[0], (PlanNeedle{"D4", 0, "s"}));
  EXPECT_EQ(plan.source, SourceModel::kAmersham6711);
  EXPECT_EQ(plan.prescription_gy, 145);
}

TEST(PlanFile, UnknownKeysAreRefusedWithLineAndNearestName) {
  EXPECT_EQ(toml_refusal(kHead + "prescripton = 3\n" + needle("D4", "s")),
            "plan.toml:5: unknown key 'prescripton'; did you mean 'prescription_gy'?");
  EXPECT_EQ(toml_refusal(kHead + needle("D4", "s", "retraction = 3\n")),
            "plan.toml:8: unknown key 'needle.retraction'; did you mean 'needle.retraction_mm'?");
}

TEST(PlanFile, NeedlesThatMakeNoSenseAreRefusedWithLineAndFix) {
  EXPECT_EQ(toml_refusal(kHead + needle("N4", "s")),
            "plan.toml:6: 'needle.hole' is \"N4\"; the template has A1 … M13");
  EXPECT_EQ(
      toml_refusal(kHead + needle("D4", "s") + needle("E4", "s") + needle("D4", "s")),
      "plan.toml:12: 'needle.hole' is \"D4\" for the second time (needles 1 and 3); use each hole once");
  EXPECT_EQ(toml_refusal(kHead + needle("D4", "s-x")),
            "plan.toml:7: 'needle.train' is \"s-x\"; it is s for a seed and - for a spacer, from the tip "
            "backwards");
  EXPECT_EQ(toml_refusal(kHead + needle("D4", "--")),
            "plan.toml:7: 'needle.train' has no seed; add an s or remove the needle");
  EXPECT_EQ(toml_refusal(kHead + needle("D4", "s", "retraction_mm = -1\n")),
            "plan.toml:8: 'needle.retraction_mm' is -1; it must be between 0 and 500");
  EXPECT_EQ(toml_refusal(kHead + needle("D4", "s-s-s", "retraction_mm = 60\n")),
            "plan.toml:7: 'needle.train' is 24.5 mm long and the tip stops 20 mm beyond the template; "
            "shorten it or "
            "lower retraction_mm");
  EXPECT_EQ(toml_refusal(kHead + "[[needle]]\ntrain = \"s\"\n"),
            "plan.toml:5: 'needle.hole' is missing; a [[needle]] has a hole and a train, such as \"D4\" and "
            "\"s-s--s\"");
  EXPECT_EQ(
      user_error([] { parse_plan_toml(kHead + needle("D4", "s"), "plan.toml", {}, 70); }),
      "plan.toml:6: 'needle.hole' has its tip 80 mm beyond the template and the needle is 70 mm long; lower "
      "base_plane_mm");
}

TEST(PlanFile, WhatHoldsForAllNeedlesIsChecked) {
  for (const char* strength : {"0", "-0.5", "nan", "inf", "101"})
    EXPECT_EQ(toml_refusal("source = \"200\"\nair_kerma_strength_u = " + std::string(strength))
                  .find("plan.toml:2: 'air_kerma_strength_u' is "),
              0u);
  EXPECT_NE(toml_refusal("prescription_gy = 0").find("plan.toml:1: 'prescription_gy' is 0; it must be"),
            std::string::npos);
  EXPECT_NE(toml_refusal("source = \"125\"").find("one of: 6711, 200"), std::string::npos);
  EXPECT_EQ(toml_refusal("name = \"a\\nb\""),
            "plan.toml:1: 'name' has a line end, a control character or invalid UTF-8; write it as one "
            "line of text");
  EXPECT_NE(toml_refusal("name = \"a\"\n" + needle("D4", "s")).find("'source' is missing"),
            std::string::npos);
  EXPECT_NE(toml_refusal(kHead).find("a plan has at least one [[needle]]"), std::string::npos);
  EXPECT_EQ(toml_refusal("name = [").find("plan.toml:1: not valid TOML"), 0u);
}

TEST(PlanFile, CsvRowsAreCheckedAsTomlIs) {
  const std::string good = "D4,0,s,80,6711,0.5,145,test\n";
  EXPECT_EQ(parse_plan_csv("\xEF\xBB\xBF# seeds\n" + kCsvHead + "\r\n" + good, "p", {}, kNeedle).name,
            "test");
  EXPECT_EQ(csv_refusal(kCsvHead + good + good).find("plan.csv:3: 'hole' is \"D4\" for the second time"), 0u);
  EXPECT_EQ(csv_refusal(kCsvHead + "D14,0,s,80,6711,0.5,145,\n"),
            "plan.csv:2: 'hole' is \"D14\"; the template has A1 … M13");
  EXPECT_EQ(csv_refusal(kCsvHead + "D4,-1,s,80,6711,0.5,145,\n"),
            "plan.csv:2: 'retraction_mm' is -1; it must be between 0 and 500");
  EXPECT_EQ(csv_refusal(kCsvHead + "D4,1 mm,s,80,6711,0.5,145,\n"),
            "plan.csv:2: 'retraction_mm' needs a number, such as 12.5");
  EXPECT_EQ(csv_refusal(kCsvHead + "D4,0,s,80,6702,0.5,145,\n"),
            "plan.csv:2: 'source' is \"6702\"; it must be one of: 6711, 200, cs1-rev2");
  EXPECT_EQ(csv_refusal(kCsvHead + "D4,0,s,80,6711,nan,145,\n").find("plan.csv:2: 'air_kerma_strength_u' is"),
            0u);
  EXPECT_EQ(csv_refusal(kCsvHead + good + "E4,0,s,81,6711,0.5,145,test\n")
                .find("plan.csv:3: differs from the first row in the columns after train"),
            0u);
  EXPECT_EQ(csv_refusal(kCsvHead + "D4,0,s,80\n").find("plan.csv:2: found 4 columns, expected 8"), 0u);
  EXPECT_EQ(csv_refusal(kCsvHead + "D4,0,s,80,6711,0.5,145,\"test\n"),
            "plan.csv:2: a \" is not closed; close it on the same line");
  EXPECT_EQ(csv_refusal(kCsvHead + "D4,0,s,80,6711,0.5,145,\"test\"s\n").find("plan.csv:2: text follows"),
            0u);
  EXPECT_EQ(
      csv_refusal(kCsvHead + "D4,0,s,80,6711,0.5,145,a\xBD\n").find("plan.csv:2: 'name' has a line end"), 0u);
  EXPECT_EQ(csv_refusal(kCsvHead + "\x1B[2J,0,s,80,6711,0.5,145,\n"),
            "plan.csv:2: 'hole' is \" [2J\"; the template has A1 … M13");
  EXPECT_EQ(csv_refusal("hole,train\nD4,s\n").find("plan.csv:1: expected the header"), 0u);
  EXPECT_EQ(csv_refusal(kCsvHead).find("plan.csv:1: no needle"), 0u);
  EXPECT_EQ(csv_refusal("").find("plan.csv:1: no needle"), 0u);
}

TEST(PlanFile, AnyTruncationIsAcceptedOrRefusedInOneLine) {
  const Plan plan = awkward_plan(3);
  for (const std::string& text : {to_toml(plan, {}), to_csv(plan, {})})
    for (std::size_t n = 0; n < text.size(); ++n)
      for (const auto parse : {parse_plan_toml, parse_plan_csv}) try {
          parse(text.substr(0, n), "plan", {}, kNeedle);
        } catch (const UserError& e) {
          EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
        }
}

TEST(PlanFile, AScenesPlanHasItsTemplateItsNeedleAndNoMoreSeedsThanItTakes) {
  const TempFile file("plan.toml", to_toml(awkward_plan(2), {}));
  const std::string plan = "[plan]\nfile = \"" + file.path().string() + "\"\n";
  EXPECT_FALSE(load_plan(parse_scene("", "scene.toml")));
  EXPECT_EQ(load_plan(parse_scene(plan, "scene.toml")), awkward_plan(2));
  EXPECT_NE(user_error([&] {
              load_plan(parse_scene(plan + "[template]\ncolumns = 12", "s"));
            }).find("the template has A1 … L13"),
            std::string::npos);
  EXPECT_NE(user_error([&] {
              load_plan(parse_scene(plan + "[needle]\nlength_mm = 90", "s"));
            }).find("the needle is 90 mm long"),
            std::string::npos);
  EXPECT_NE(user_error([&] {
              load_plan(parse_scene(plan + "[seeds]\nmax_count = 31", "s"));
            }).find("32 seeds, but the scene allows 31; raise seeds.max_count"),
            std::string::npos);
}

}  // namespace
}  // namespace brachy
