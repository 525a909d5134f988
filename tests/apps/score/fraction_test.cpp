// The session of an HDR fraction: its page, exercise and history, as an implant has them.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>

#include "tests/apps/apps_testing.h"
#include "tests/apps/running_brachyd.h"

namespace brachy {
namespace {

using namespace test;

/// Three catheters, inserted as planned and, by another hand, the second one 8 mm short.
struct Fraction : ::testing::Test {
  void SetUp() override {
    std::filesystem::copy_file(kConfigFolder / "exercises/plans/12_three_catheters.toml", in("plan.toml"));
    scene = folder.write("scene.toml",
                         small_scene("[needle]\ncount = 3\n[implant]\nkind = \"hdr\"\n[plan]\nfile = "
                                     "\"plan.toml\"\n[dose]\nprescription_gy = 13.5\n"));
    exercise = folder.write("exercise.toml",
                            "name = \"three\"\nasks = \"a\"\nscene = \"scene.toml\"\n[passes]\n"
                            "catheters_missing_at_most = 0\ncatheters_placed_at_least = 3\n"
                            "tip_depth_error_mm_at_most = 2\ndwell_largest_error_mm_at_most = 6\n");
    ASSERT_TRUE(exited(run_brachy({"plan", "--config", scene, "--trajectory", in("good.csv")}), 0));
    folder.write("short.csv", shortened(read_file(in("good.csv")), "1", 8));
  }
  std::string in(const std::string& name) const { return (folder / name).string(); }
  void replay(const std::string& trajectory, const std::string& session, const std::string& trainee) const {
    ASSERT_TRUE(exited(run_brachy({"replay", in(trajectory), "--offline", "--config", scene, "--session",
                                   in(session), "--trainee", trainee}),
                       0));
  }
  nlohmann::json report_of(const std::string& session) const {
    return nlohmann::json::parse(read_file(in(session + "/hdr_report.json")));
  }
  /// The rows of a needle end `mm` before its last one's depth.
  static std::string shortened(const std::string& csv, const std::string& needle, double mm) {
    std::istringstream lines(csv);
    std::string text, line;
    std::vector<std::vector<std::string>> rows;
    double deepest = -INFINITY;
    while (std::getline(lines, line)) {
      std::vector<std::string>& cells = rows.emplace_back();
      std::istringstream row(line);
      for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
      if (rows.size() > 1 && cells.back() == needle) deepest = std::max(deepest, std::stod(cells[kZ]));
    }
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (r > 0 && rows[r].back() == needle)
        rows[r][kZ] = std::to_string(std::min(std::stod(rows[r][kZ]), deepest - mm));
      for (std::size_t c = 0; c < rows[r].size(); ++c) text += (c ? "," : "") + rows[r][c];
      text += "\n";
    }
    return text;
  }
  static constexpr std::size_t kZ = 12;  // the column m23 behind t_s

  TempFolder folder;
  std::string scene, exercise;
};

TEST_F(Fraction, PassesItsExerciseWhereTheCathetersLieAsPlanned) {
  replay("good.csv", "good", "Anna");
  const Ended passed = run_brachy({"score", in("good"), "--exercise", exercise});
  EXPECT_TRUE(exited(passed, 0)) << passed.out;
  EXPECT_NE(passed.out.find("exercise \"three\": passed"), std::string::npos) << passed.out;
  const std::string page = read_file(in("good/report.html"));
  for (const char* text : {"Fraction score", "<b>Anna</b>", "mhdr-v2, 40300 U, a fraction of 13.5 Gy",
                           "3 of 3", "<td>I8</td>", "prostate V100", "Dose-volume histograms"})
    EXPECT_NE(page.find(text), std::string::npos) << text;

  replay("short.csv", "short", "Bea");
  const Ended failed = run_brachy({"score", in("short"), "--exercise", exercise});
  EXPECT_TRUE(exited(failed, 1)) << failed.out;
  EXPECT_NE(failed.out.find("MISS largest error of a tip's depth 8 mm, at most 2"), std::string::npos)
      << failed.out;
  EXPECT_NE(read_file(in("short/report.html")).find("1 catheter 8.0 mm too shallow: I8"), std::string::npos);
  // The whole catheter is 8 mm lower, and the planned times go with it.
  const auto good = report_of("good"), bad = report_of("short");
  EXPECT_NEAR(bad["catheters"][1]["tip_error_mm"][2].get<double>(), -8, 1e-6);
  EXPECT_EQ(bad["about"]["trainee"], "Bea");
  EXPECT_LT(bad["dose"]["delivered"]["prostate"]["v100_percent"]["value"].get<double>(),
            good["dose"]["delivered"]["prostate"]["v100_percent"]["value"].get<double>() - 1);

  const Ended history = run_brachy({"score", "--history", (folder / ".").string(), "--csv", in("all.csv")});
  ASSERT_TRUE(exited(history, 0)) << history.err;
  const std::string csv = read_file(in("all.csv"));
  EXPECT_NE(csv.find("\nshort,"), std::string::npos) << csv;
  EXPECT_NE(history.out.find("placed                  3.00      3.00"), std::string::npos) << history.out;
}

TEST_F(Fraction, OptionsAreThoseOfAnImplant) {
  replay("good.csv", "s", "Anna");
  const std::string page = read_file(in("s/report.html")), json = read_file(in("s/hdr_report.json"));
  ASSERT_TRUE(exited(run_brachy({"score", in("s"), "--out", in("x.html")}), 0));
  EXPECT_EQ(read_file(in("x.html")), page);
  EXPECT_EQ(read_file(in("x.json")), json);
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s"), "--out", in("x.html")}), {"x.", "--force"}));
  EXPECT_EQ(json_of(run_brachy({"score", in("s"), "--json"})), nlohmann::json::parse(json));

  std::string another = read_file(in("plan.toml"));
  another.replace(another.find("D8"), 2, "D7");
  folder.write("another.toml", another);
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s"), "--plan", in("another.toml")}),
                                  {"another.toml", "not the plan"}));
  const Ended what_if =
      run_brachy({"score", in("s"), "--plan", in("another.toml"), "--what-if", "--out", in("y.html")});
  EXPECT_TRUE(exited(what_if, 0)) << what_if.err;
  EXPECT_NE(read_file(in("y.html")).find("What if"), std::string::npos);
  EXPECT_EQ(read_file(in("s/report.html")), page);

  folder.write("s/report.html", "the trainee's own notes");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s")}), {"report.html", "--out", "--force"}));
  EXPECT_TRUE(exited(run_brachy({"score", in("s"), "--force"}), 0));
  EXPECT_EQ(read_file(in("s/report.html")), page);
}

TEST_F(Fraction, WithoutItsCathetersFileThePageSaysWhatWasAssumed) {
  replay("good.csv", "s", "Anna");
  std::filesystem::remove(in("s/catheters.csv"));
  const Ended ended = run_brachy({"score", in("s"), "--force"});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  EXPECT_NE(ended.err.find("catheters.csv is missing: catheters are taken as straight"), std::string::npos)
      << ended.err;
  EXPECT_NE(read_file(in("s/report.html")).find("catheters.csv is missing"), std::string::npos);
  EXPECT_LT(report_of("s")["catheters"][0]["dwells_mean_mm"].get<double>(), 1e-6);
}

}  // namespace
}  // namespace brachy
