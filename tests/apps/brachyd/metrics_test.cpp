#include <gtest/gtest.h>

#include "haptics/trajectory/trajectory.h"
#include "tests/apps/apps_testing.h"
#include "tests/data_dir.h"

namespace brachy {
namespace {

using namespace test;

std::string row(const std::string& t, const std::string& z, const std::string& needle = "") {
  return t + ",1,0,0,1,0,1,0,2,0,0,1," + z + (needle.empty() ? "" : "," + needle) + "\n";
}

struct Metrics : ::testing::Test {
  TempFolder folder;
  std::string mesh = folder.write("o.stl", octahedron_stl(30));  // |x| + |y| + |z| < 30
  std::string header = std::string(kTrajectoryHeader);
};

TEST_F(Metrics, OfOneNeedle) {
  const std::string file = folder.write(
      "t.csv", header + "\n" + row("0", "-40") + row("1", "-20") + row("3", "10") + row("4", "-40"));
  const Ended ended = run_brachy({"metrics", file, "--mesh", mesh, "--json"});
  ASSERT_TRUE(exited(ended, 0));
  const auto json = json_of(ended);
  EXPECT_EQ(json.at("elapsed_time_s"), 4);
  EXPECT_EQ(json.at("path_length_mm"), 100);
  EXPECT_EQ(json.at("path_in_tissue_mm"), 50);
  EXPECT_EQ(json.at("time_in_tissue_s"), 3);
  EXPECT_EQ(json.at("passes"), 1);
  EXPECT_EQ(json.at("speed_mm_s").at("p50"), 20);
  EXPECT_EQ(json.at("speed_mm_s").at("max"), 50);
  EXPECT_EQ(json.at("needles").size(), 1u);
  const Ended text = run_brachy({"metrics", file, "--mesh", mesh});
  EXPECT_NE(text.out.find("100.000"), std::string::npos) << text.out;
  EXPECT_EQ(text.out.find("all"), std::string::npos) << text.out;
}

TEST_F(Metrics, OfSeveralNeedlesEachAndTogether) {
  const std::string file =
      folder.write("t.csv", header + ",needle,button\n" + row("0", "-40", "0,0") + row("0", "-41", "3,1") +
                                row("1", "-20", "0,0") + row("2", "0", "3,0"));
  const auto json = json_of(run_brachy({"metrics", file, "--mesh", mesh, "--json"}));
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("needles")[0].at("needle"), 0);
  EXPECT_EQ(json.at("needles")[0].at("path_in_tissue_mm"), 20);
  EXPECT_EQ(json.at("needles")[1].at("needle"), 3);
  EXPECT_EQ(json.at("needles")[1].at("path_in_tissue_mm"), 41);
  EXPECT_EQ(json.at("path_in_tissue_mm"), 61);
  EXPECT_EQ(json.at("time_in_tissue_s"), 3);
  EXPECT_EQ(json.at("elapsed_time_s"), 2);
  EXPECT_EQ(json.at("passes"), 2);
  const Ended text = run_brachy({"metrics", file, "--mesh", mesh});
  EXPECT_NE(text.out.find("   all"), std::string::npos) << text.out;
}

TEST_F(Metrics, WhatHasNoSpeedIsNullAndADash) {
  const std::string file = folder.write("t.csv", header + "\n" + row("0", "0"));
  EXPECT_TRUE(
      json_of(run_brachy({"metrics", file, "--mesh", mesh, "--json"})).at("speed_mm_s").at("p50").is_null());
  EXPECT_NE(run_brachy({"metrics", file, "--mesh", mesh}).out.find("–"), std::string::npos);
}

TEST_F(Metrics, RefusesWhatItCannotMeasureAgainst) {
  const std::string file = folder.write("t.csv", header + "\n" + row("0", "0"));
  const std::string open = folder.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"metrics", file, "--mesh", open}), {"open.obj", "3"}));
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"metrics", "none.csv", "--mesh", mesh}), {"none.csv", "no such file"}));
  EXPECT_TRUE(refused_in_one_line(
      run_brachy(
          {"metrics", folder.write("b.csv", header + ",button\n" + row("0", "0", "2")), "--mesh", mesh}),
      {"b.csv:2", "button 2", "0 or 1"}));
  EXPECT_TRUE(exited(run_brachy({"metrics", file}), 2));
}

TEST_F(Metrics, TheRecordedInsertionIsAsPublished) {
  BRACHY_REQUIRE_DATA(data);
  const auto json = json_of(run_brachy({"metrics", (data / "trajectories/inplane_needle_tip.csv").string(),
                                        "--mesh", (data / "meshes/inplane_tissue.stl").string(), "--json"}));
  ASSERT_FALSE(json.is_discarded());
  for (const auto& [key, published] : {std::pair{"elapsed_time_s", 27.437},
                                       {"path_length_mm", 280.892},
                                       {"path_in_tissue_mm", 164.915},
                                       {"time_in_tissue_s", 21.866}})
    EXPECT_NEAR(json.at(key).get<double>(), published, 1e-4 * published) << key;
}

}  // namespace
}  // namespace brachy
