#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "apps/forces/force_log.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

constexpr const char* kPoseHeader = "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23";

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
  EXPECT_EQ(first.at("reinitialized"), false);
  // Every tick has a verdict, and one that is not injective is flagged.
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
    // Such a push would fold: the guard clamps it, and without the guard the displacement is larger.
    EXPECT_GT(json.at("max_disp_mm").get<double>(), 0.5) << kernel;
    EXPECT_GT(json.at("max_held_mm").get<double>(), 1) << kernel;
    const auto unguarded = json_of(
        offline(trajectory,
                folder.write("u.toml", small_scene("[stability]\npolicy = \"flag\"\n" + model + regions))));
    EXPECT_GT(unguarded.at("max_disp_mm").get<double>(), 2) << kernel;
    EXPECT_EQ(unguarded.at("max_held_mm"), 0) << kernel;
    EXPECT_NE(json.at("state_hash"), plain.at("state_hash")) << kernel;
    EXPECT_EQ(json_of(offline(trajectory, folder.write("s.toml", small_scene(model + regions)))), json);
  }
  EXPECT_TRUE(refused_in_one_line(
      offline(trajectory, folder.write("s.toml", small_scene("[model]\nkernel = \"elastic\"\n" + regions))),
      {"s.toml:8", "region.shear_modulus_kpa", "elastic"}));
}

/// Invariants of every row.
void expect_consistent(const ForceSample& row) {
  const NeedleForces& f = row.forces;
  EXPECT_NEAR(f.axial_n, f.cutting_n + f.friction_n, 1e-9 * (1 + std::abs(f.axial_n))) << row.t_s;
  EXPECT_NEAR(f.force_n.squaredNorm(), f.axial_n * f.axial_n + f.lateral_n * f.lateral_n,
              1e-9 * (1 + f.force_n.squaredNorm()))
      << row.t_s;
  EXPECT_GE(f.lateral_n, 0) << row.t_s;
  EXPECT_GE(f.cutting_n, -1e-9) << row.t_s;  // solved for, so to rounding
  if (row.landmarks == 0) {
    EXPECT_EQ(f.force_n, Vec3::Zero()) << row.t_s;
  }
}

TEST(ReplayOffline, TheLogSaysHowFarANeedleBends) {
  const TempFolder folder;
  const std::string scene = folder.write(
      "s.toml",
      small_scene("[model]\nkernel = \"elastic\"\n[needle]\nflexible = true\nguide_at = \"template\"\n"
                  "bevel_force_share = 1\n"));
  const std::string trajectory = folder.write("t.csv", short_insertion(1)), log = (folder / "f.csv").string();
  const auto json = json_of(offline(trajectory, scene, {"--log", log}));
  ASSERT_FALSE(json.is_discarded());
  double most = 0;
  for (const ForceSample& row : load_force_log(log)) most = std::max(most, row.tip_deflection_mm);
  EXPECT_GT(most, 5) << "its bevel is pushed aside with all of the cutting force";
  EXPECT_GT(json.at("ticks_steep").get<int>(), 0);
  EXPECT_EQ(json.at("needles").at(0).at("max_tip_deflection_mm"), most);
  const auto rigid = json_of(offline(trajectory, folder.write("r.toml", small_scene())));
  EXPECT_EQ(rigid.at("needles").at(0).at("max_tip_deflection_mm"), 0);
  EXPECT_EQ(rigid.at("ticks_steep"), 0);
}

TEST(ReplayOffline, SaysWhereARigidNeedleTakesMoreThanARealOneBears) {
  const TempFolder folder;
  const std::string trajectory = folder.write("t.csv", short_insertion(1));
  const auto said = [&](const std::string& needle, const std::string& kpa) {
    const std::string scene =
        "[model]\nkernel = \"elastic\"\n[tissue]\npoints = 1500\nshear_modulus_kpa = " + kpa +
        "\n[needle]\nflexible = " + needle + "\n";
    const Ended ended =
        run_brachy({"replay", trajectory, "--offline", "--config", folder.write("s.toml", scene)});
    EXPECT_TRUE(exited(ended, 0)) << ended.err;
    return ended.out.find("would bend any needle") != std::string::npos;
  };
  EXPECT_TRUE(said("false", "120"));
  EXPECT_FALSE(said("true", "120"));
  EXPECT_FALSE(said("false", "6"));
}

TEST(ReplayOffline, TheLogHasARowATick) {
  const TempFolder folder;
  const std::string scene = folder.write("s.toml", small_scene()), log = (folder / "f.csv").string();
  const std::string trajectory = folder.write("t.csv", short_insertion(1));
  const auto json = json_of(offline(trajectory, scene, {"--log", log}));
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(
      lines_of(read_file(log))[0],
      "t_s,needle,state,depth_mm,fx_n,fy_n,fz_n,axial_n,lateral_n,cutting_n,friction_n,landmarks,min_det,"
      "tip_deflection_mm,guide_x_n,guide_y_n,guide_z_n");
  const std::vector<ForceSample> rows = load_force_log(log);
  ASSERT_EQ(rows.size(), json.at("ticks").get<std::size_t>());
  EXPECT_EQ(rows[0].t_s, 0);
  EXPECT_EQ(rows[0].state, ContactState::kFree);
  EXPECT_EQ(rows.back().t_s, 1);
  EXPECT_EQ(rows.back().state, ContactState::kWithdrawn);
  double depth = 0, out = 0, in = 0, det = 1;
  std::uint64_t in_contact = 0;
  for (const ForceSample& row : rows) {
    EXPECT_EQ(row.needle, 0u);
    expect_consistent(row);
    depth = std::max(depth, row.depth_mm);
    out = std::max(out, row.forces.axial_n);
    in = std::max(in, -row.forces.axial_n);
    det = std::min(det, row.min_det);
    in_contact += row.landmarks > 0;
  }
  // The summary is the log's.
  EXPECT_GT(depth, 10);
  EXPECT_GT(in_contact, 50u);
  EXPECT_EQ(json.at("max_depth_mm"), depth);
  EXPECT_EQ(json.at("min_vertex_det"), det);
  const auto& needle = json.at("needles").at(0);
  EXPECT_EQ(needle.at("needle"), 0);
  EXPECT_EQ(needle.at("contact"), "withdrawn");
  EXPECT_EQ(needle.at("max_depth_mm"), depth);
  EXPECT_EQ(needle.at("peak_out_n"), out);
  EXPECT_EQ(needle.at("peak_in_n"), in);
  for (const char* key :
       {"puncture_n", "cutting_share_at_deepest", "friction_share_at_deepest", "cutting_share_of_work",
        "friction_share_of_work", "insertion_work_nmm", "hand_work_nmm"})
    EXPECT_TRUE(needle.contains(key)) << key;
}

TEST(ReplayOffline, TheLogHasTheTrajectorysTimes) {
  const TempFolder folder;
  const std::string trajectory =
      folder.write("t.csv", std::string(kPoseHeader) +
                                "\n100.5,1,0,0,8,0,1,0,-4,0,0,1,-40\n100.7,1,0,0,8,0,1,0,-4,0,0,1,-39\n");
  const std::string log = (folder / "f.csv").string();
  ASSERT_TRUE(
      exited(offline(trajectory, folder.write("s.toml", small_scene()), {"--log", log, "--speed", "2"}), 0));
  const std::vector<ForceSample> rows = load_force_log(log);
  ASSERT_EQ(rows.size(), 21u);
  EXPECT_EQ(rows.front().t_s, 50.25);
  EXPECT_NEAR(rows.back().t_s, 50.35, 1e-12);
}

TEST(ReplayOffline, ALogThatCannotBeMadeIsRefusedAndAFullDiskCostsOnlyTheLog) {
  const TempFolder folder;
  const std::string scene = folder.write("s.toml", small_scene()), log = (folder / "f.csv").string();
  const std::string trajectory = folder.write("t.csv", short_insertion(0.5));
  EXPECT_TRUE(exited(offline(trajectory, scene, {"--log", log}), 0));
  const std::string first = read_file(log);
  EXPECT_TRUE(refused_in_one_line(offline(trajectory, scene, {"--log", log}), {log, "exists", "--force"}));
  EXPECT_TRUE(
      refused_in_one_line(offline(trajectory, scene, {"--log", trajectory, "--force"}), {"is an input"}));
  EXPECT_TRUE(exited(offline(trajectory, scene, {"--log", log, "--force"}), 0));
  EXPECT_EQ(read_file(log), first);
  EXPECT_TRUE(refused_in_one_line(offline(trajectory, scene, {"--log", (folder / "no/f.csv").string()}),
                                  {"no/f.csv"}));
  const Ended full = offline(trajectory, scene, {"--log", "/dev/full"});
  EXPECT_TRUE(exited(full, 1));
  EXPECT_EQ(json_of(full).at("ticks"), 101);
  EXPECT_NE(full.err.find("/dev/full"), std::string::npos) << full.err;
  EXPECT_NE(full.err.find("No space left"), std::string::npos) << full.err;
  EXPECT_TRUE(exited(run_brachy({"replay", trajectory, "--connect", "127.0.0.1:1", "--log", log + "x"}), 2));
}

TEST(ReplayOffline, AFileInOtherUnitsOrWithASingleRowIsDoubted) {
  const TempFolder folder;
  const std::string scene = folder.write("s.toml", small_scene());
  const std::string header = "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n";
  const auto remarks = [&](const std::string& rows) {
    const Ended ended = offline(folder.write("t.csv", header + rows), scene, {"--speed", "100"});
    EXPECT_TRUE(exited(ended, 0));
    return ended.err;
  };
  EXPECT_NE(remarks("0,1,0,0,0,0,1,0,0,0,0,1,-40\n").find("has a single row"), std::string::npos);
  const std::string metres = "0,1,0,0,0,0,1,0,0,0,0,1,-0.04\n1,1,0,0,0,0,1,0,0,0,0,1,0.02\n";
  EXPECT_NE(remarks(metres).find("are positions in metres?"), std::string::npos);
  const std::string ms = "0,1,0,0,0,0,1,0,0,0,0,1,-40\n900,1,0,0,0,0,1,0,0,0,0,1,-38\n";
  EXPECT_NE(remarks(ms).find("are times in milliseconds?"), std::string::npos);
  EXPECT_EQ(remarks("0,1,0,0,0,0,1,0,0,0,0,1,-40\n1,1,0,0,0,0,1,0,0,0,0,1,-20\n"), "");
}

TEST(ReplayOffline, ShippedTrajectoriesGoInAndComeOut) {
  const TempFolder folder;
  const std::string log = (folder / "f.csv").string();
  const auto json = json_of(offline((kConfigFolder / "insertion_5mm_s.csv").string(),
                                    folder.write("s.toml", small_scene()), {"--log", log}));
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("contact"), "withdrawn");
  EXPECT_EQ(json.at("reinitialized"), false);
  EXPECT_EQ(json.at("dissipated_nmm"), json.at("needles")[0].at("hand_work_nmm"));
  EXPECT_GE(json.at("dissipated_nmm").get<double>(), 0);
  EXPECT_GT(json.at("max_depth_mm").get<double>(), 30);
  EXPECT_LT(json.at("max_depth_mm").get<double>(), 45);
  EXPECT_EQ(load_force_log(log).size(), 4401u);
}

TEST(ReplayOffline, ATrajectoryOfMoreNeedlesThanTheSceneHasNamesTheSettingToRaise) {
  const TempFolder folder;
  EXPECT_TRUE(refused_in_one_line(
      offline((kConfigFolder / "insertion_three_needles.csv").string(),
              folder.write("s.toml", small_scene())),
      {"insertion_three_needles.csv:5: moves needle 1", "raise needle.count in the scene to 2"}));
}

std::string several_needles(int count) {
  return small_scene("[needle]\ncount = " + std::to_string(count) + "\n");
}

// Sped up: this tests which needle moves when, not the tissue.
TEST(ReplayOffline, SeveralNeedlesComeAndStayAsTheFileSays) {
  const TempFolder folder;
  const std::string scene = folder.write("s.toml", several_needles(3)), log = (folder / "f.csv").string();
  const auto json = json_of(offline((kConfigFolder / "insertion_three_needles.csv").string(), scene,
                                    {"--log", log, "--speed", "4"}));
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("ticks"), 1551);
  ASSERT_EQ(json.at("needles").size(), 3u);
  EXPECT_EQ(json.at("needles")[0].at("contact"), "withdrawn");
  EXPECT_EQ(json.at("needles")[1].at("contact"), "inserted");
  EXPECT_EQ(json.at("needles")[2].at("contact"), "inserted");
  EXPECT_EQ(json.at("punctures"), 3);
  EXPECT_TRUE(json.at("dissipated_nmm").is_null());  // two needles are still in the tissue
  std::array<double, 3> first_s = {-1, -1, -1}, depth_mm{};
  std::array<std::size_t, 3> rows{};
  for (const ForceSample& row : load_force_log(log)) {
    expect_consistent(row);
    ASSERT_LT(row.needle, 3u);
    if (rows[row.needle]++ == 0) first_s[row.needle] = row.t_s;
    depth_mm[row.needle] = row.depth_mm;
  }
  EXPECT_EQ(first_s, (std::array<double, 3>{2.25, 0, 1.125}));
  EXPECT_EQ(rows, (std::array<std::size_t, 3>{1101, 1551, 1326}));
  EXPECT_EQ(depth_mm[0], 0);
  EXPECT_GT(depth_mm[1], 25);
  EXPECT_GT(depth_mm[2], 25);
}

TEST(ReplayOffline, OneNeedleIsTheSameInASceneOfSeveral) {
  const TempFolder folder;
  const std::string trajectory = folder.write("t.csv", short_insertion(0.5));
  const std::string log1 = (folder / "1.csv").string(), log3 = (folder / "3.csv").string();
  const auto one = json_of(offline(trajectory, folder.write("1.toml", several_needles(1)), {"--log", log1}));
  const auto three =
      json_of(offline(trajectory, folder.write("3.toml", several_needles(3)), {"--log", log3}));
  ASSERT_FALSE(one.is_discarded());
  EXPECT_EQ(three.at("needles"), one.at("needles"));
  EXPECT_EQ(read_file(log3), read_file(log1));
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
  const std::string header = std::string(kPoseHeader) + "\n", row = "0,1,0,0,8,0,1,0,-4,0,0,1,-40\n";
  const auto with = [&](const std::string& text) { return offline(folder.write("bad.csv", text), scene); };
  EXPECT_TRUE(refused_in_one_line(with(header + row + "1,1,0,0,nan,0,1,0,-4,0,0,1,-40\n"),
                                  {"bad.csv:3", "column 5", "nan"}));
  EXPECT_TRUE(refused_in_one_line(with(header + row + "1,1,0,0,8,0,1,0,-4,0,0,1,inf\n"), {"bad.csv:3"}));
  EXPECT_TRUE(refused_in_one_line(with("t,x,y,z\n0,1,2,3\n"), {"bad.csv:1", "t_s,m00"}));
  EXPECT_TRUE(refused_in_one_line(with(row), {"bad.csv:1", "t_s,m00"}));
  EXPECT_TRUE(refused_in_one_line(with(header + row + "1,1,0,0,8,0,1"), {"bad.csv:3", "truncated"}));
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

// Forces and depths from there on are those of the whole replay, to the last digit.
TEST(ReplayOffline, ASessionGoesOnFromItsMiddle) {
  const TempFolder folder;
  const std::string scene = folder.write("scene.toml", small_scene());
  const std::string session = (folder / "session").string(), whole = (folder / "whole.csv").string(),
                    later = (folder / "later.csv").string();
  ASSERT_TRUE(exited(offline(folder.write("t.csv", short_insertion(24)), scene, {"--session", session}), 0));
  const std::string poses = session + "/poses.csv";
  const auto all = json_of(offline(poses, scene, {"--log", whole}));
  const Ended ended = offline(poses, scene, {"--log", later, "--from", "17"});
  const auto half = json_of(ended);
  ASSERT_FALSE(half.is_discarded()) << ended.err;
  EXPECT_NE(ended.err.find("goes on from 10 s"), std::string::npos) << ended.err;
  EXPECT_EQ(all.at("ticks").get<int>() - half.at("ticks").get<int>(), 2000);
  const std::string rows = read_file(whole), rows_later = read_file(later);
  const std::size_t header = rows_later.find('\n') + 1;
  ASSERT_GT(rows_later.size(), 100'000u);
  EXPECT_EQ(rows.substr(rows.size() - (rows_later.size() - header)), rows_later.substr(header));

  EXPECT_TRUE(refused_in_one_line(offline(poses, scene, {"--from", "5"}), {"states", "every 10 s"}));
  const std::string other = folder.write("other.toml", small_scene("[contact]\nrelaxation_share = 0.3\n"));
  EXPECT_TRUE(refused_in_one_line(offline(poses, other, {"--from", "17"}), {"another scene", "--config"}));
}

}  // namespace
}  // namespace brachy
