#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <sstream>

#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/scene/load_structures.h"
#include "haptics/trajectory/trajectory.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

const std::string kPhantomScene = (kConfigFolder / "prostate.toml").string();
const std::string kPlan = (kConfigFolder / "plan.toml").string();

double figure(const nlohmann::json& report, const char* structure, const char* name) {
  for (const auto& f : report["figures"])
    if (f["structure"] == structure && f["name"] == name) return f["value"];
  ADD_FAILURE() << "no " << structure << " " << name;
  return 0;
}

TEST(PlanTool, GeneratesTheShippedPlanAgain) {
  const TempFolder folder;
  const std::string out = (folder / "plan.toml").string();
  ASSERT_TRUE(exited(
      run_brachy({"plan", "--generate", "--method", "rule", "--config", kPhantomScene, "--out", out}), 0));
  EXPECT_EQ(read_file(out), read_file(kPlan));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plan", kPlan, "--out", out}), {out, "exists", "--force"}));
  EXPECT_TRUE(exited(run_brachy({"plan", kPlan, "--out", out, "--force"}), 0));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plan", out, "--out", out, "--force"}), {"is an input"}));
}

TEST(PlanTool, WhatCannotBePlannedIsRefusedWithTheNearestThatCan) {
  const Ended ended = run_brachy({"plan", "--generate", "--strength-u", "2"});
  EXPECT_TRUE(exited(ended, 3));
  EXPECT_NE(ended.err.find("refused: seeds of 2 U"), std::string::npos) << ended.err;
  EXPECT_NE(ended.err.find("the nearest is 0.76 U"), std::string::npos) << ended.err;
}

TEST(PlanTool, PlansTheNeedlesThatAreLeft) {
  const TempFolder folder;
  const TemplateGrid grid;
  const Plan plan = load_plan(kPlan, grid);
  std::string placed = std::string(kDoseSeedHeader) + "\n";
  for (const PlannedSeed& seed : plan.seeds(grid))
    if (seed.needle < 10)
      placed += std::to_string(seed.position.x()) + "," + std::to_string(seed.position.y()) + "," +
                std::to_string(seed.position.z()) + ",0,0,1,6711,0.502\n";
  const std::string seeds = folder.write("placed.csv", placed), out = (folder / "rest.toml").string();
  const Ended ended = run_brachy({"plan", kPlan, "--generate", "--placed", seeds, "--out", out, "--json"});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  EXPECT_GT(json_of(ended)["placed_seed_count"], 30);
  EXPECT_GT(figure(json_of(ended), "prostate", "V100"), 95);
  EXPECT_LE(load_plan(out, grid).needles.size(), plan.needles.size() - 10);
}

TEST(PlanTool, TheShippedPlanReachesTheGoals) {
  const Ended ended = run_brachy({"plan", kPlan, "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(ended.err, "");
  const nlohmann::json report = json_of(ended);
  EXPECT_GT(figure(report, "prostate", "V100"), 95);
  EXPECT_LT(figure(report, "prostate", "V150"), 60);
  EXPECT_GT(figure(report, "prostate", "D90"), 140);
  EXPECT_LT(figure(report, "urethra", "D30"), 1.25 * 145);
  EXPECT_LT(figure(report, "rectum", "V100"), 1);
  for (const auto& f : report["figures"]) EXPECT_TRUE(f.value("met", true)) << f;
  const double total = report["total_strength_u"], customary = report["customary_strength_u"];
  EXPECT_NEAR(customary, 2.15 * 4.5 * 4.5, 1e-6);  // 50 × 40 × 45 mm
  EXPECT_NEAR(total, report["seed_count"].get<double>() * report["air_kerma_strength_u"].get<double>(), 1e-9);
  EXPECT_GT(total, 0.65 * customary);
  EXPECT_LT(total, 1.15 * customary);
  EXPECT_EQ(report["needles"].size(), report["needle_count"]);
}

TEST(PlanTool, ASceneBringsItsPlan) {
  const std::string session = (kConfigFolder / "session.toml").string();
  const Ended of_scene = run_brachy({"plan", "--config", session, "--json"});
  ASSERT_TRUE(exited(of_scene, 0));
  EXPECT_EQ(json_of(of_scene), json_of(run_brachy({"plan", kPlan, "--json"})));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plan"}), {"no plan", "--generate"}));
}

TEST(PlanTool, SaysWhatMissesItsGoal) {
  std::string weak = read_file(kPlan);
  const auto at = weak.find("air_kerma_strength_u = 0.");
  ASSERT_NE(at, std::string::npos);
  weak.replace(at, 25, "air_kerma_strength_u = 0.1");
  const TempFolder folder;
  const Ended ended = run_brachy({"plan", folder.write("weak.toml", weak)});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.out.find("≥ 95  MISSED"), std::string::npos) << ended.out;
  EXPECT_EQ(ended.out.find("< 60  MISSED"), std::string::npos) << ended.out;
}

TEST(PlanTool, WritesThePlanAndItsSeedsAsCsvThatReadBack) {
  const TempFolder folder;
  const std::string csv = (folder / "plan.csv").string(), again = (folder / "again.toml").string(),
                    seeds = (folder / "seeds.csv").string();
  ASSERT_TRUE(exited(run_brachy({"plan", kPlan, "--csv", csv, "--seeds", seeds}), 0));
  ASSERT_TRUE(exited(run_brachy({"plan", csv, "--out", again}), 0));
  EXPECT_EQ(read_file(again), read_file(kPlan));
  const TemplateGrid grid;
  const auto planned = load_plan(kPlan, grid).seeds(grid);
  const auto written = load_dose_seeds(seeds);
  ASSERT_EQ(written.size(), planned.size());
  for (std::size_t s = 0; s < written.size(); ++s) {
    EXPECT_EQ(written[s].position, planned[s].position);
    EXPECT_EQ(written[s].axis, planned[s].axis);
    EXPECT_EQ(written[s].source, planned[s].source);
    EXPECT_EQ(written[s].air_kerma_strength_u, planned[s].air_kerma_strength_u);
  }
}

TEST(PlanTool, WritesTheStructuresForParaview) {
  const TempFolder folder;
  const auto out = folder / "made/structures";
  ASSERT_TRUE(exited(run_brachy({"plan", kPlan, "--structures", out.string()}), 0));
  const std::string index = read_file(out / "structures.pvd");
  for (const Structure& s : load_structures(Scene())) {
    EXPECT_NE(index.find("file=\"" + s.name + ".vtp\""), std::string::npos) << index;
    const std::string vtp = read_file(out / (s.name + ".vtp"));
    std::ostringstream piece;
    piece << "<Piece NumberOfPoints=\"" << s.mesh.vertices.size() << "\"";
    EXPECT_NE(vtp.find(piece.str()), std::string::npos);
    // The points' block: a byte count, then the first vertex.
    const auto data = vtp.find("\n_", vtp.find("<AppendedData")) + 2;
    std::uint64_t bytes = 0;
    float x = 0;
    std::memcpy(&bytes, vtp.data() + data, sizeof bytes);
    std::memcpy(&x, vtp.data() + data + sizeof bytes, sizeof x);
    EXPECT_EQ(bytes, s.mesh.vertices.size() * 3 * sizeof(float));
    EXPECT_EQ(x, static_cast<float>(s.mesh.vertices[0].x()));
  }
}

TEST(PlanTool, ASessionGoesToEveryTipInTurnAndHoldsTheButtonOnTheWayOut) {
  const TempFolder folder;
  const std::string file = (folder / "session.csv").string();
  ASSERT_TRUE(exited(run_brachy({"plan", kPlan, "--trajectory", file, "--speed-mm-s", "40"}), 0));
  const Trajectory session = load_trajectory(file);
  const TemplateGrid grid;
  const Plan plan = load_plan(kPlan, grid);
  std::size_t presses = 0;
  Vec3 pressed_at = Vec3::Zero();
  for (std::size_t i = 1; i < session.samples().size(); ++i) {
    const TrajectorySample &before = session.samples()[i - 1], &now = session.samples()[i];
    EXPECT_EQ(now.X_WN.R, Mat3::Identity());
    const double speed = (now.X_WN.p - before.X_WN.p).norm() / (now.t_s - before.t_s);
    EXPECT_LT(speed, 40 + 1e-6);
    if (now.button && !before.button) {
      ASSERT_LT(presses, plan.needles.size());
      pressed_at = now.X_WN.p;
      EXPECT_EQ(pressed_at, plan.planned_tip(grid, presses));
      EXPECT_EQ(before.X_WN.p, pressed_at);  // at rest
      ++presses;
    }
    // for the press to be seen
    const bool waits = before.button && now.X_WN == before.X_WN && before.X_WN.p == pressed_at;
    if (before.button && !waits) {  // straight back, slowly while the train is dropped
      const PlanNeedle& needle = plan.needles[presses - 1];
      EXPECT_EQ(now.X_WN.p.head<2>(), pressed_at.head<2>());
      EXPECT_LT(now.X_WN.p.z(), before.X_WN.p.z());
      const bool leaves_seeds = pressed_at.z() - before.X_WN.p.z() < needle.train_length_mm() - 1e-6;
      if (leaves_seeds) {
        EXPECT_NEAR(speed, 20, 1e-6);
      }
    }
    if (now.X_WN.p.head<2>() != before.X_WN.p.head<2>()) {
      EXPECT_LT(now.X_WN.p.z(), grid.origin_mm.z());  // across: outside
      EXPECT_FALSE(before.button);
    }
  }
  EXPECT_EQ(presses, plan.needles.size());
}

TEST(PlanTool, RefusesWhatIsNoPlanOfTheScene) {
  const TempFolder folder;
  std::string text = read_file(kPlan);
  text.replace(text.find("hole = \"") + 8, 3, "Z10");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plan", folder.write("p.toml", text)}),
                                  {"p.toml:11", "needle.hole", "Z10", "A1 … M13"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"plan", (folder / "none.toml").string()}), {"no such plan"}));
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"plan", kPlan, "--out", "/nonexistent/p.toml"}), {"/nonexistent"}));
  EXPECT_TRUE(exited(run_brachy({"plan", kPlan, "--generate"}), 2));
  EXPECT_TRUE(exited(run_brachy({"plan", kPlan, "--out", "p.txt"}), 2));
  EXPECT_TRUE(exited(run_brachy({"plan", kPlan, "--speed-mm-s", "50"}), 2));
}

TEST(PlanTool, WhatIsAskedForIsNeverIgnored) {
  const auto says = [](std::vector<std::string> line, const std::string& text) {
    line.insert(line.begin(), {"plan", "--generate"});
    const Ended ended = run_brachy(line);
    return exited(ended, 2) && ended.err.find(text) != std::string::npos && ended.out.empty();
  };
  for (const std::vector<std::string>& of_seeds : {std::vector<std::string>{"--lock", "D4"},
                                                   {"--forbid", "D4"},
                                                   {"--fewest-needles"},
                                                   {"--max-seeds-per-needle", "4"},
                                                   {"--strengths", "0.4,0.5"},
                                                   {"--margin-mm", "3"},
                                                   {"--posterior-margin-mm", "1"}}) {
    std::vector<std::string> line = of_seeds;
    line.emplace_back("--hdr");
    EXPECT_TRUE(says(line, "this is a plan of catheters")) << of_seeds.front();
  }
  EXPECT_TRUE(says({"--lock", "D4", "--forbid", "G5,D4"}, "both name D4"));
  EXPECT_TRUE(says({"--method", "rule", "--forbid", "D4"}, "--method annealing"));
  EXPECT_TRUE(says({"--forbid", "Z9"}, "--forbid Z9: the template has A1"));
  const TempFolder folder;
  const std::string seeds =
      folder.write("placed.csv", "x,y,z,ax,ay,az,source,strength_u\n0,0,0,0,0,1,6711,0.5\n");
  EXPECT_TRUE(says({"--placed", seeds, "--posterior-margin-mm", "1"}, "excludes"));
  EXPECT_TRUE(says({"--strengths", "0.4", "--seeds", (folder / "s.csv").string()}, "excludes"));
}

}  // namespace
}  // namespace brachy
