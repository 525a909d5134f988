// `brachy score`, end to end.
#include <gtest/gtest.h>

#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/score/score_fixtures.h"

namespace brachy {
namespace {

using namespace test;

struct ScoreTool : ::testing::Test {
  TempFolder folder;
  std::string plan = folder.write("plan.toml", to_toml(small_plan(), {}));
  std::string recording = (folder / "").string();

  ScoreTool() {
    std::string seeds = std::string(kSeedHeader) + "\n";
    for (const Seed& seed : small_seeds()) seeds += seed_row(seed) + "\n";
    folder.write("seeds.csv", seeds);
    folder.write("poses.csv", short_insertion(2));
  }
};

TEST_F(ScoreTool, WritesPageAndJsonIntoTheRecordingAndSaysWhatIsMissing) {
  const Ended ended = run_brachy({"score", recording, "--plan", plan});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.err.find("forces.csv is missing"), std::string::npos) << ended.err;
  EXPECT_NE(ended.out.find("3 of 3 placed, 0 missing, 0 extra; placed ones 2.7 mm mean"), std::string::npos)
      << ended.out;
  const auto json = nlohmann::json::parse(read_file(folder / "report.json"));
  EXPECT_NEAR(json.at("seeds").at("rest_error").at("total_mm").at("mean").get<double>(), 8.0 / 3, 1e-12);
  EXPECT_EQ(json.at("dose").at("plan").at("structures").size(), 3u);  // the phantom's
  EXPECT_EQ(json.at("needles").at("total").at("passes"), 1);
  EXPECT_TRUE(json.at("needles").at("total").at("punctures").is_null());
  const std::string html = read_file(folder / "report.html");
  EXPECT_NE(html.find("forces.csv is missing"), html.npos);
  EXPECT_NE(html.find("rectum"), html.npos);
}

TEST_F(ScoreTool, WritesWhereItIsAskedToAndPrintsTheJson) {
  const std::string out = (folder / "other.html").string();
  const Ended ended = run_brachy({"score", recording, "--plan", plan, "--out", out, "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(json_of(ended), nlohmann::json::parse(read_file(folder / "other.json")));
  EXPECT_FALSE(std::filesystem::exists(folder / "report.html"));
}

TEST_F(ScoreTool, TakesThePlanOfTheScene) {
  const std::string scene = folder.write("s.toml", small_scene("[plan]\nfile = \"plan.toml\"\n"));
  const Ended ended = run_brachy({"score", recording, "--config", scene, "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(json_of(ended).at("plan"), "small");
}

TEST_F(ScoreTool, LeavesTheProbeOutOfTheNeedlesScore) {
  const std::string probe = ",1,0,0,0,0,1,0,-34,0,0,1,30,1\n";
  std::string poses;
  for (const std::string& line : lines_of(short_insertion(2)))
    poses += line + (poses.empty() ? ",needle\n" : ",0\n" + line.substr(0, line.find(',')) + probe);
  folder.write("poses.csv", poses);
  const auto of_scene = [&](const std::string& more) {
    const std::string scene = folder.write("s.toml", small_scene("[plan]\nfile = \"plan.toml\"\n" + more));
    const Ended ended = run_brachy({"score", recording, "--config", scene, "--json", "--force"});
    EXPECT_TRUE(exited(ended, 0));
    return json_of(ended);
  };
  const auto with = of_scene("[model]\nkernel = \"elastic\"\n[probe]\non = true\n");
  EXPECT_EQ(with.at("structures_entered").dump().find("rectum"), std::string::npos);
  EXPECT_EQ(with.at("needles").at("total").at("passes"), 1);
  // Without a probe in the scene it is a second needle.
  EXPECT_NE(of_scene("[needle]\ncount = 2\n").at("structures_entered").dump().find("rectum"),
            std::string::npos);
}

TEST_F(ScoreTool, RefusesWhatItCannotScore) {
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", recording}), {"no plan", "--plan"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", (folder / "none").string(), "--plan", plan}),
                                  {"none", "no such directory"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", recording, "--plan", (folder / "no.toml").string()}),
                                  {"no.toml"}));
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"score", recording, "--plan", plan, "--out", (folder / "no/r.html").string()}),
      {"no folder"}));
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"score", recording, "--plan", plan, "--out", (folder / "r.json").string()}),
      {"r.json", "page"}));
  Plan one = small_plan();
  one.needles.resize(1);
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"score", recording, "--plan", folder.write("one.toml", to_toml(one, {}))}),
      {"seed 3", "give the plan"}));
}

/// The dropped seeds of a session as a table, as a planning system has them after an implant.
std::string table_of_small_seeds() {
  return to_csv(at_rest(small_seeds()));
}

TEST_F(ScoreTool, OfAFileOfSeedsTheImplantIsScored) {
  const std::string seeds = folder.write("post.csv", table_of_small_seeds()),
                    out = (folder / "post.html").string();
  const Ended by_plan = run_brachy({"score", seeds, "--plan", plan, "--out", out, "--json"});
  ASSERT_TRUE(exited(by_plan, 0)) << by_plan.err;
  const auto json = json_of(by_plan);
  // What a session with the same seeds has of them.
  const auto session = json_of(run_brachy({"score", recording, "--plan", plan, "--json"}));
  EXPECT_EQ(json.at("seeds").at("rest_error"), session.at("seeds").at("rest_error"));
  EXPECT_EQ(json.at("dose").at("rest"), session.at("dose").at("rest"));
  EXPECT_EQ(json.at("dose").at("plan"), session.at("dose").at("plan"));
  const Ended alone = run_brachy({"score", seeds, "--out", (folder / "alone.html").string(), "--json"});
  ASSERT_TRUE(exited(alone, 0)) << alone.err;
  EXPECT_NE(alone.err.find("There is no plan"), std::string::npos) << alone.err;
  const auto without = json_of(alone);
  EXPECT_TRUE(without.at("seeds").is_null());
  EXPECT_EQ(without.at("findings"), nlohmann::json::array());
  EXPECT_EQ(without.at("dose").at("rest").at("structures").at(0).at("d90_gy"),
            json.at("dose").at("rest").at("structures").at(0).at("d90_gy"));
  const Ended nowhere = run_brachy({"score", seeds, "--plan", plan});
  EXPECT_TRUE(exited(nowhere, 2));
  EXPECT_NE(nowhere.err.find("is a file of seeds: give the page a place with --out"), std::string::npos)
      << nowhere.err;
}

TEST_F(ScoreTool, SeedsThatWereThereBeforeAreNobodysMistake) {
  std::vector<Seed> all = seeds_at_start(at_rest(small_seeds()));
  for (Seed& seed : all) seed.dropped = seed.rest = seed.position = seed.rest + Vec3(20, 10, 0);
  std::uint32_t id = static_cast<std::uint32_t>(all.size());
  for (Seed seed : small_seeds()) {
    seed.id = ++id;
    all.push_back(seed);
  }
  const auto before = json_of(run_brachy({"score", recording, "--plan", plan, "--json"}));
  std::string text = std::string(kSeedHeader) + "\n";
  for (const Seed& seed : all) text += seed_row(seed) + "\n";
  folder.write("seeds.csv", text);
  const auto json = json_of(run_brachy({"score", recording, "--plan", plan, "--json", "--force"}));
  EXPECT_EQ(json.at("seeds").at("unplanned"), before.at("seeds").at("unplanned"));
  EXPECT_EQ(json.at("seeds").at("rest_error"), before.at("seeds").at("rest_error"));
  // All count in the dose, of the plan as well.
  EXPECT_EQ(json.at("dose").at("rest").at("seeds"), 6);
  EXPECT_EQ(json.at("dose").at("plan").at("seeds"), 6);
}

}  // namespace
}  // namespace brachy
