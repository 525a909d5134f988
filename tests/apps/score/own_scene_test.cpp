// `brachy score` and its like know what a session was: its own scene, plan and exercise, and no other.
#include <gtest/gtest.h>

#include "apps/session/session_manifest.h"
#include "core/base/error.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/running_brachyd.h"

namespace brachy {
namespace {

using namespace test;

constexpr const char* kSmallPlan =
    "name = \"own\"\nsource = \"6711\"\nair_kerma_strength_u = 0.5\nprescription_gy = 145\nbase_plane_mm = "
    "82\n"
    "[[needle]]\nhole = \"H7\"\nretraction_mm = 2\ntrain = \"s-s-s\"\n";

/// A session of a scene that is not the phantom, computed offline, and other scenes, plans and exercises beside it.
struct OwnScene : ::testing::Test {
  static std::string scene_with(const std::string& more) {
    return small_scene(
        "[plan]\nfile = \"plan.toml\"\n[seeds]\napplicator = \"train\"\n"
        "[[structure]]\nname = \"rectum\"\nfile = \"rectum.stl\"\n" +
        more);
  }
  void SetUp() override {
    folder.write("plan.toml", kSmallPlan);
    folder.write("rectum.stl", octahedron_stl(12));
    scene = folder.write("scene.toml", scene_with(""));
    other = folder.write("other.toml", scene_with("[needle]\nlength_mm = 190\n"));
    ASSERT_TRUE(exited(
        run_brachy({"plan", "--config", scene, "--trajectory", in("needles.csv"), "--speed-mm-s", "200"}),
        0));
    ASSERT_TRUE(exited(run_brachy({"replay", in("needles.csv"), "--offline", "--config", scene, "--session",
                                   in("s"), "--trainee", "Anna"}),
                       0));
    report = read_file(folder / "s/report.json");
    page = read_file(folder / "s/report.html");
  }
  std::string in(const std::string& name) const { return (folder / name).string(); }
  std::string exercise(const std::string& name, const std::string& of) const {
    return folder.write(name + ".toml", "name = \"" + name + "\"\nasks = \"a\"\nscene = \"" + of +
                                            "\"\n[passes]\nplaced_at_least = 3\n");
  }
  /// The trainee's report is as it was.
  bool is_kept() const {
    return read_file(folder / "s/report.json") == report && read_file(folder / "s/report.html") == page;
  }

  TempFolder folder;
  std::string scene, other, report, page;
};

TEST_F(OwnScene, IsTakenWithoutAnyOption) {
  const Ended ended = run_brachy({"score", in("s"), "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(json_of(ended), nlohmann::json::parse(report)) << "never silently the phantom";
  EXPECT_TRUE(is_kept());
  // Also by the scene's own name, and the plan as a table.
  ASSERT_TRUE(exited(run_brachy({"plan", in("plan.toml"), "--csv", in("plan.csv")}), 0));
  EXPECT_TRUE(exited(run_brachy({"score", in("s"), "--config", scene, "--plan", in("plan.csv")}), 0));
  EXPECT_TRUE(is_kept());
}

TEST_F(OwnScene, AnotherSceneOrPlanIsRefusedWithTheReason) {
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s"), "--config", other}),
                                  {"another scene", "needle.length_mm was 200", "--what-if"}));
  std::string text = kSmallPlan;
  text.replace(text.find("H7"), 2, "F7");
  const std::string another = folder.write("another.toml", text);
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s"), "--plan", another}),
                                  {"another.toml", "not the plan"}));
  EXPECT_FALSE(exited(run_brachy({"score", in("s"), "--plan", another, "--what-if"}), 0)) << "it needs --out";
  const Ended what_if =
      run_brachy({"score", in("s"), "--plan", another, "--what-if", "--out", in("what_if.html")});
  ASSERT_TRUE(exited(what_if, 0));
  EXPECT_NE(what_if.err.find("What if"), std::string::npos) << what_if.err;
  EXPECT_NE(read_file(in("what_if.html")).find("What if"), std::string::npos);
  EXPECT_TRUE(is_kept());
}

TEST_F(OwnScene, APlanThatChangedMeanwhileIsStillTheOneAtTheStart) {
  std::string text = kSmallPlan;
  text.replace(text.find("H7"), 2, "F7");
  folder.write("plan.toml", text);
  const Ended ended = run_brachy({"score", in("s"), "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(json_of(ended), nlohmann::json::parse(report));
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"replay", in("s/poses.csv"), "--offline"}), {"the plan is another"}));
}

TEST_F(OwnScene, AMeshThatChangedMeanwhileIsRefused) {
  folder.write("rectum.stl", octahedron_stl(13));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s")}), {"has changed since", "rectum"}));
  std::filesystem::remove(in("rectum.stl"));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s")}), {"rectum.stl", "--config"}));
  EXPECT_TRUE(is_kept());
}

TEST_F(OwnScene, AnExerciseIsPassedBySessionsOfItsOwnSceneAlone) {
  const std::string own = exercise("own", "scene.toml"), moving = exercise("moving", "other.toml");
  const Ended passed = run_brachy({"score", in("s"), "--exercise", own});
  ASSERT_TRUE(exited(passed, 0));
  EXPECT_NE(passed.out.find("exercise \"own\": passed"), std::string::npos) << passed.out;
  // The report gains the result and nothing else, and keeps it.
  auto judged = nlohmann::json::parse(read_file(folder / "s/report.json"));
  EXPECT_EQ(judged["exercise"]["name"], "own");
  EXPECT_EQ(judged["exercise"]["passed"], true);
  EXPECT_FALSE(judged["exercise"]["lines"].empty());
  judged["exercise"] = nullptr;
  EXPECT_EQ(judged, nlohmann::json::parse(report));
  report = read_file(folder / "s/report.json");
  page = read_file(folder / "s/report.html");
  EXPECT_NE(page.find("Exercise &ldquo;own&rdquo;: <b>passed</b>"), std::string::npos);
  EXPECT_TRUE(exited(run_brachy({"score", in("s")}), 0));
  EXPECT_TRUE(is_kept());
  for (const std::vector<std::string>& more : {std::vector<std::string>{},
                                               {"--config", scene},
                                               {"--config", other},
                                               {"--force"},
                                               {"--out", in("x.html")}}) {
    std::vector<std::string> line = {"score", in("s"), "--exercise", moving};
    line.insert(line.end(), more.begin(), more.end());
    EXPECT_TRUE(refused_in_one_line(run_brachy(line), {"not of exercise \"moving\"", "needle.length_mm"}));
  }
  // Nor with goals that its scene has not.
  folder.write("easy.toml", scene_with("[[goal]]\nstructure = \"prostate\"\nfigure = \"V100\"\nlimit = 1\n"));
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"score", in("s"), "--exercise", own, "--config", in("easy.toml")}), {"[[goal]]"}));
  EXPECT_TRUE(is_kept());
}

TEST_F(OwnScene, AReportThatSaysSomethingElseIsNotOverwritten) {
  folder.write("s/report.html", "the trainee's own notes");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s")}), {"report.html", "--out", "--force"}));
  EXPECT_EQ(read_file(folder / "s/report.html"), "the trainee's own notes");
  EXPECT_TRUE(exited(run_brachy({"score", in("s"), "--force"}), 0));
  EXPECT_TRUE(is_kept());
  // A link that was put there is not followed, not even with --force.
  const std::string victim = folder.write("victim", "text");
  std::filesystem::remove(folder / "s/report.html");
  std::filesystem::create_symlink(victim, folder / "s/report.html");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s"), "--force"}), {"report.html", "a link"}));
  EXPECT_EQ(read_file(victim), "text");
}

TEST_F(OwnScene, OfBeforeThereWereManifestsIsReadAndSaidSo) {
  std::filesystem::remove(folder / "s/session.json");
  const Ended ended = run_brachy({"score", in("s"), "--config", scene, "--json", "--out", in("x.html")});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.err.find("has no session.json"), std::string::npos) << ended.err;
  auto nameless = nlohmann::json::parse(report);
  EXPECT_EQ(nameless["about"]["trainee"], "Anna");
  nameless["about"]["trainee"] = "";
  EXPECT_EQ(json_of(ended), nameless);
  EXPECT_TRUE(is_kept());
}

TEST_F(OwnScene, ComesTwiceWithTheSameBytes) {
  ASSERT_TRUE(exited(run_brachy({"replay", in("needles.csv"), "--offline", "--config", scene, "--session",
                                 in("twice/s"), "--trainee", "Anna"}),
                     0));
  for (const auto& file : std::filesystem::directory_iterator(folder / "s"))
    EXPECT_EQ(read_file(file.path()), read_file(folder / "twice/s" / file.path().filename().string()))
        << file.path();
  const SessionManifest manifest = parse_manifest(read_file(folder / "s/session.json"), "m");
  EXPECT_TRUE(manifest.runs.empty());
  EXPECT_EQ(manifest.trainee, "Anna");
  EXPECT_EQ(manifest.scene.text, read_file(scene));
}

TEST_F(OwnScene, IsReplayedInItAndInNoOther) {
  const auto hash = [](const Ended& ended) { return json_of(ended).at("state_hash").get<std::string>(); };
  const Ended own = run_brachy({"replay", in("s/poses.csv"), "--offline", "--json"});
  ASSERT_TRUE(exited(own, 0));
  const Ended named = run_brachy({"replay", in("s/poses.csv"), "--offline", "--json", "--config", scene});
  ASSERT_TRUE(exited(named, 0));
  EXPECT_EQ(hash(own), hash(named));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"replay", in("s/poses.csv"), "--offline", "--config", other}),
                                  {"another scene", "needle.length_mm", "--what-if"}));
  EXPECT_TRUE(
      exited(run_brachy({"replay", in("s/poses.csv"), "--offline", "--config", other, "--what-if"}), 0));
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"plan", "--generate", "--config", other, "--placed", in("s/seeds.csv")}),
      {"another scene"}));
}

// The daemon's session: a time, the trainee, and no other scene when it goes on.
TEST_F(OwnScene, ADaemonGoesOnWithItsOwnSceneOnly) {
  for (int run = 1; run <= 2; ++run) {
    RunningBrachyd brachyd(scene, {"--session", in("live"), "--trainee", "Anna"});
    brachyd.process.send_signal(SIGTERM);
    ASSERT_TRUE(exited(brachyd.process.wait(), 0));
    const SessionManifest manifest = parse_manifest(read_file(folder / "live/session.json"), "m");
    ASSERT_EQ(manifest.runs.size(), static_cast<std::size_t>(run));
    EXPECT_EQ(manifest.runs.back().began.size(), std::string("2026-11-28T09:30:00Z").size());
    EXPECT_GE(manifest.runs.back().ended, manifest.runs.back().began);
  }
  const std::string before = read_file(folder / "live/session.json");
  const auto expect_refused = [](const Ended& ended, const std::string& part) {
    EXPECT_TRUE(exited(ended, 2));
    EXPECT_NE(ended.err.find(part), std::string::npos) << ended.err;
    EXPECT_EQ(ended.out, "") << "it does not listen";
  };
  expect_refused(run_brachyd({"--config", other, "--session", in("live")}),
                 "another scene: needle.length_mm");
  expect_refused(run_brachyd({"--config", scene, "--session", in("live"), "--trainee", "Ben"}),
                 "of trainee Anna");
  EXPECT_EQ(read_file(folder / "live/session.json"), before);
}

}  // namespace
}  // namespace brachy
