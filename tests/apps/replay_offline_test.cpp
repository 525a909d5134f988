#include <gtest/gtest.h>

#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

constexpr const char* kHeader = "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23";

std::string default_scene() {
  return (kConfigFolder / "prostate.toml").string();
}
std::string default_trajectory() {
  return (kConfigFolder / "insertion.csv").string();
}

Ended offline(const std::string& trajectory, const std::string& scene,
              const std::vector<std::string>& more = {}) {
  std::vector<std::string> line = {"replay", trajectory, "--offline", "--config", scene, "--json"};
  line.insert(line.end(), more.begin(), more.end());
  return run_brachy(line);
}

TEST(ReplayOffline, DefaultSceneAndTrajectoryGiveTheSameHashOnEveryRun) {
  const auto first = json_of(offline(default_trajectory(), default_scene()));
  ASSERT_FALSE(first.is_discarded());
  EXPECT_EQ(first.at("ticks"), 3001);
  EXPECT_EQ(first.at("points"), 14560);
  EXPECT_EQ(first.at("contact"), "withdrawn");
  EXPECT_EQ(first.at("punctures"), 2);
  EXPECT_EQ(first.at("solve_failed"), false);
  EXPECT_EQ(first.at("saturated"), false);
  EXPECT_EQ(first.at("reseated"), false);
  // Every tick has a verdict, and what is not injective says so.
  EXPECT_EQ(first.at("ticks_injective").get<int>() + first.at("ticks_folded").get<int>() +
                first.at("ticks_unknown").get<int>(),
            3001);
  EXPECT_EQ(first.at("ticks_unflagged"), 0);
  EXPECT_EQ(first.at("nonfinite"), 0);
  EXPECT_GT(first.at("max_disp_mm").get<double>(), 1);
  EXPECT_LT(first.at("max_disp_mm").get<double>(), 10);
  EXPECT_GT(first.at("moved").get<int>(), 1000);
  EXPECT_GT(first.at("ticks_in_contact").get<int>(), 1000);
  EXPECT_EQ(first.at("state_hash").get<std::string>().size(), 16u);
  const auto second = json_of(offline(default_trajectory(), default_scene()));
  EXPECT_EQ(second, first);
}

TEST(ReplayOffline, TheBuiltInSceneIsTheConfigFile) {
  const TempFolder folder;
  const std::string short_one = folder.write("t.csv", short_insertion(0.5));
  const auto given = json_of(offline(short_one, default_scene()));
  const auto built_in = json_of(run_brachy({"replay", short_one, "--offline", "--json"}));
  ASSERT_FALSE(given.is_discarded());
  EXPECT_EQ(built_in, given);
}

// Short: on a busy core two threads may cost a scheduler slice a tick.
TEST(ReplayOffline, TwoThreadsGiveTheSameHashAsOne) {
  const TempFolder folder;
  const std::string trajectory = folder.write("t.csv", short_insertion(1));
  const auto one = json_of(offline(trajectory, default_scene(), {"--threads", "1"}));
  const auto two = json_of(offline(trajectory, default_scene(), {"--threads", "2"}));
  ASSERT_FALSE(one.is_discarded());
  EXPECT_EQ(one.at("ticks"), 201);
  EXPECT_GT(one.at("max_disp_mm").get<double>(), 1);
  EXPECT_EQ(two, one);
}

TEST(ReplayOffline, EveryKernelGivesAnotherHash) {
  const TempFolder folder;
  const std::string trajectory = folder.write("t.csv", short_insertion(0.5));
  std::vector<std::string> hashes;
  for (const char* kernel : {"psi30", "psi31", "psi32", "buhmann"}) {
    const std::string scene =
        folder.write("s.toml", small_scene("[model]\nkernel = \"" + std::string(kernel) + "\"\n"));
    const auto json = json_of(offline(trajectory, scene));
    ASSERT_FALSE(json.is_discarded()) << kernel;
    EXPECT_EQ(json.at("solve_failed"), false) << kernel;
    EXPECT_EQ(json.at("contact"), "withdrawn") << kernel;
    const auto hash = json.at("state_hash").get<std::string>();
    EXPECT_EQ(std::count(hashes.begin(), hashes.end(), hash), 0) << kernel;
    hashes.push_back(hash);
  }
}

// A region's mesh is read beside the scene.
TEST(ReplayOffline, RegionsOfOtherSupportChangeTheHash) {
  const TempFolder folder;
  folder.write("nodule.stl", octahedron_stl(14));
  const std::string trajectory = folder.write("t.csv", short_insertion(0.5));
  const std::string regions =
      "[[region]]\nshape = \"mesh\"\nfile = \"nodule.stl\"\nsupport_radius_mm = 20\n"
      "[[region]]\nshape = \"sphere\"\ncentre_mm = [8, -4, 4]\nradius_mm = 6\nsupport_radius_mm = 6\n";
  for (const char* kernel : {"psi30", "psi32", "compact_elastic"}) {
    const std::string model = "[model]\nkernel = \"" + std::string(kernel) + "\"\n";
    const auto plain = json_of(offline(trajectory, folder.write("p.toml", small_scene(model))));
    const auto json = json_of(offline(trajectory, folder.write("s.toml", small_scene(model + regions))));
    ASSERT_FALSE(json.is_discarded()) << kernel;
    EXPECT_EQ(json.at("solve_failed"), false) << kernel;
    EXPECT_EQ(json.at("contact"), "withdrawn") << kernel;
    EXPECT_GT(json.at("max_disp_mm").get<double>(), 1) << kernel;
    EXPECT_NE(json.at("state_hash"), plain.at("state_hash")) << kernel;
    EXPECT_EQ(json_of(offline(trajectory, folder.write("s.toml", small_scene(model + regions)))), json);
  }
  EXPECT_TRUE(refused_in_one_line(
      offline(trajectory, folder.write("s.toml", small_scene("[model]\nkernel = \"elastic\"\n" + regions))),
      {"s.toml:8", "region.shear_modulus_kpa", "elastic"}));
}

TEST(ReplayOffline, SpeedAndTranslationMoveTheTrajectory) {
  const TempFolder folder;
  const std::string trajectory = folder.write("t.csv", short_insertion(1));
  const std::string scene = folder.write("s.toml", small_scene());
  EXPECT_EQ(json_of(offline(trajectory, scene, {"--speed", "2"})).at("ticks"), 101);
  const auto beside = json_of(offline(trajectory, scene, {"--translate-mm", "200,0,0"}));
  EXPECT_EQ(beside.at("contact"), "free");
  EXPECT_EQ(beside.at("max_disp_mm"), 0);
  EXPECT_EQ(beside.at("moved"), 0);
}

TEST(ReplayOffline, RefusesABadTrajectoryInOneLineWithFileAndLine) {
  const TempFolder folder;
  const std::string scene = folder.write("s.toml", small_scene());
  const std::string header = std::string(kHeader) + "\n", row = "0,1,0,0,8,0,1,0,-4,0,0,1,-40\n";
  const auto with = [&](const std::string& text) { return offline(folder.write("bad.csv", text), scene); };
  EXPECT_TRUE(refused_in_one_line(with(header + row + "1,1,0,0,nan,0,1,0,-4,0,0,1,-40\n"),
                                  {"bad.csv:3", "column 5", "nan"}));
  EXPECT_TRUE(refused_in_one_line(with(header + row + "1,1,0,0,8,0,1,0,-4,0,0,1,inf\n"), {"bad.csv:3"}));
  EXPECT_TRUE(refused_in_one_line(with("t,x,y,z\n0,1,2,3\n"), {"bad.csv:1", "t_s,m00"}));
  EXPECT_TRUE(refused_in_one_line(with(row), {"bad.csv:1", "t_s,m00"}));
  EXPECT_TRUE(refused_in_one_line(with(header + row + "1,1,0,0,8,0,1"), {"bad.csv:3", "cut off"}));
  EXPECT_TRUE(refused_in_one_line(with(header + row + row), {"bad.csv:3", "increase"}));
  EXPECT_TRUE(
      refused_in_one_line(with(header + "0,2,0,0,8,0,2,0,-4,0,0,2,-40\n"), {"bad.csv:2", "rotation"}));
  EXPECT_TRUE(refused_in_one_line(with(header), {"bad.csv:1", "no rows"}));
  EXPECT_TRUE(refused_in_one_line(with(""), {"bad.csv:1", "empty"}));
  EXPECT_TRUE(refused_in_one_line(with(std::string("\0\xff\xfe binary\0", 11)), {"bad.csv:1"}));
  EXPECT_TRUE(refused_in_one_line(offline((folder / "none.csv").string(), scene), {"none.csv"}));
  EXPECT_TRUE(refused_in_one_line(offline((folder / "").string(), scene), {"not a file"}));
}

TEST(ReplayOffline, RefusesABadSceneInOneLineWithFileAndLine) {
  const TempFolder folder;
  const std::string trajectory = folder.write("t.csv", short_insertion(0.1));
  const auto with = [&](const std::string& text) {
    return offline(trajectory, folder.write("bad.toml", text));
  };
  EXPECT_TRUE(refused_in_one_line(with("[model]\nkernal = \"psi31\"\n"),
                                  {"bad.toml:2", "model.kernal", "did you mean 'model.kernel'"}));
  EXPECT_TRUE(refused_in_one_line(with("[model]\nkernel = \"psi99\"\n"), {"bad.toml:2", "psi99", "buhmann"}));
  EXPECT_TRUE(refused_in_one_line(with("[model]\nsupport_radius_mm = nan\n"), {"bad.toml:2"}));
  EXPECT_TRUE(refused_in_one_line(with("[model]\nsupport_radius_mm = -1\n"), {"bad.toml:2"}));
  EXPECT_TRUE(refused_in_one_line(with("[tissue]\npoints = 3000.5\n"), {"bad.toml:2"}));
  EXPECT_TRUE(refused_in_one_line(with("[tissue\npoints = 1"), {"bad.toml:1", "TOML"}));
  EXPECT_TRUE(refused_in_one_line(with(std::string("\0\xff\xfe", 3)), {"bad.toml:1"}));
  EXPECT_TRUE(refused_in_one_line(offline(trajectory, (folder / "none.toml").string()), {"none.toml"}));
  // An empty scene is all defaults.
  EXPECT_TRUE(exited(with(""), 0));
}

TEST(ReplayOffline, NeedsEitherOfflineOrADaemon) {
  const Ended neither = run_brachy({"replay", default_trajectory()});
  EXPECT_TRUE(exited(neither, 2));
  EXPECT_NE(neither.err.find("--offline"), std::string::npos) << neither.err;
  const Ended both = run_brachy({"replay", default_trajectory(), "--offline", "--connect", "127.0.0.1:1"});
  EXPECT_TRUE(exited(both, 2));
  EXPECT_EQ(both.out, "");
}

}  // namespace
}  // namespace brachy
