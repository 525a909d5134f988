#include <gtest/gtest.h>

#include "apps/forces/force_log.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

const std::string kLogHeader = std::string(kForceLogHeader) + "\n";
/// Needle 0 into 12.5 mm and back, needle 3 on the capsule.
const std::string kLog = kLogHeader +
                         "0,0,touching,0,0,0,-5.5,5.5,0,5.5,0,1,1,0,0,0,0\n"
                         "0,3,touching,0,0,0,-1.5,1.5,0,1.5,0,1,1,0,0,0,0\n"
                         "1,0,inserted,12.5,0.5,0,-3,3,0.5,1.75,1.25,4,0.75,1.5,0,0,0\n"
                         "2,0,inserted,5,0,0,1.25,-1.25,0,0,-1.25,2,0.9,0.25,0,0,0\n";

struct PlotForce : ::testing::Test {
  TempFolder folder;
  std::string log = folder.write("force.csv", kLog);
};

TEST_F(PlotForce, DrawsTheFirstNeedleBesideTheLogAndTellsItsPeaks) {
  const Ended ended = run_brachy({"plot-force", log, "--json"});
  ASSERT_TRUE(exited(ended, 0));
  const auto json = json_of(ended);
  EXPECT_EQ(json.at("out"), (folder / "force.svg").string());
  EXPECT_EQ(json.at("needle"), 0);
  EXPECT_EQ(json.at("needles"), (nlohmann::json{0, 3}));
  EXPECT_EQ(json.at("rows"), 3);
  EXPECT_EQ(json.at("duration_s"), 2);
  EXPECT_EQ(json.at("max_depth_mm"), 12.5);
  EXPECT_EQ(json.at("peak_out_n"), 5.5);
  EXPECT_EQ(json.at("peak_in_n"), 1.25);
  EXPECT_EQ(json.at("puncture_n"), 5.5);
  EXPECT_EQ(json.at("axial_at_deepest_n"), 3);
  EXPECT_EQ(json.at("friction_at_deepest_n"), 1.25);
  EXPECT_EQ(json.at("min_det"), 0.75);
  EXPECT_EQ(json.at("max_tip_deflection_mm"), 1.5);
  const std::string svg = read_file(folder / "force.svg");
  EXPECT_NE(svg.find("force.csv, needle 0"), svg.npos);
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
}

TEST_F(PlotForce, DrawsALogOfBeforeNeedlesBent) {
  const std::string rigid = folder.write(
      "rigid.csv", std::string(kRigidForceLogHeader) + "\n0,0,touching,0,0,0,-5.5,5.5,0,5.5,0,1,1\n");
  const Ended ended = run_brachy({"plot-force", rigid, "--json"});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  EXPECT_EQ(json_of(ended).at("peak_out_n"), 5.5);
  EXPECT_EQ(json_of(ended).at("max_tip_deflection_mm"), 0);
}

TEST_F(PlotForce, DrawsTheNeedleAndTheFileAskedFor) {
  const std::string out = (folder / "other.svg").string();
  const Ended ended = run_brachy({"plot-force", log, "--needle", "3", "--out", out});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.out.find("1 rows of needle 3"), std::string::npos) << ended.out;
  EXPECT_NE(read_file(out).find("needle 3"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "force.svg"));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plot-force", log, "--out", out}), {out, "exists", "--force"}));
  EXPECT_NE(read_file(out).find("needle 3"), std::string::npos);
  EXPECT_TRUE(exited(run_brachy({"plot-force", log, "--out", out, "--force"}), 0));
  EXPECT_EQ(read_file(out).find("needle 3"), std::string::npos);
}

TEST_F(PlotForce, RefusesWhatItCannotReadOrWrite) {
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plot-force", log, "--needle", "1"}),
                                  {"force.csv", "needle 1", "0, 3"}));
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"plot-force", log, "--out", log}), {"force.csv", "is an input"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plot-force", log, "--out", (folder / "no/f.svg").string()}),
                                  {"no folder"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plot-force", (folder / "none.csv").string()}),
                                  {"none.csv", "no such"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plot-force", folder.write("t.csv", short_insertion(1))}),
                                  {"t.csv:1", "not a force log"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plot-force", folder.write("h.csv", kLogHeader)}),
                                  {"h.csv:1", "no rows"}));
  EXPECT_EQ(read_file(log), kLog);
}

TEST_F(PlotForce, DrawsAReplaysLog) {
  const std::string replayed = (folder / "r.csv").string();
  const std::string trajectory = folder.write("t.csv", short_insertion(0.5));
  ASSERT_TRUE(exited(run_brachy({"replay", trajectory, "--offline", "--config",
                                 folder.write("s.toml", small_scene()), "--log", replayed}),
                     0));
  const Ended ended = run_brachy({"plot-force", replayed, "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(json_of(ended).at("rows"), 101);
  EXPECT_GT(json_of(ended).at("max_depth_mm").get<double>(), 10);
}

}  // namespace
}  // namespace brachy
