#include "apps/score/class_table.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/session/session_manifest.h"
#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

/// A scored session of a class.
struct ClassSession {
  const char *folder, *exercise, *began;
  bool has_passed;
  double error_mm;
  const char* trainee = "";  ///< in its session.json
};

void write_class_session(const TempFolder& folder, const ClassSession& s) {
  std::filesystem::create_directories(folder / s.folder);
  const nlohmann::json report = {
      {"exercise",
       {{"name", s.exercise},
        {"passed", s.has_passed},
        {"lines", {{{"text", "mean error, at most <2> mm"}, {"kept", s.has_passed}}}}}},
      {"findings", {{{"text", "needle D4 is 6 mm too deep"}}, {{"text", "second"}}}},
      {"seeds", {{"by_position", {{"rest_error", {{"total_mm", {{"mean", s.error_mm}}}}}}}}}};
  folder.write(std::string(s.folder) + "/report.json", report.dump());
  SessionManifest manifest;
  manifest.trainee = s.trainee;
  manifest.exercise = ManifestText{"e.toml", "name = \"" + std::string(s.exercise) + "\"\n"};
  manifest.runs = {{"1", s.began, "", 0}};
  folder.write(std::string(s.folder) + "/session.json", to_json(manifest));
}

struct ClassTable : ::testing::Test {
  TempFolder folder;
  ClassTable() {
    for (const ClassSession& s : {ClassSession{"anna/1", "the apex", "2026-11-01T10:00:00Z", false, 4},
                                  ClassSession{"anna/2", "the apex", "2026-11-02T10:00:00Z", true, 2},
                                  ClassSession{"anna/3", "the apex", "2026-11-03T10:00:00Z", true, 1},
                                  ClassSession{"bert/1", "the apex", "2026-11-01T11:00:00Z", false, 5},
                                  ClassSession{"bert/2", "swelling, again", "2026-11-04T11:00:00Z", true, 3},
                                  ClassSession{"loose", "the apex", "2026-11-05T10:00:00Z", true, 1, "Cleo"}})
      write_class_session(folder, s);
  }
};

TEST_F(ClassTable, HasEachTraineesSessionsOfEachExercise) {
  const std::vector<TraineeTask> table = class_table(load_class(folder / "."));
  ASSERT_EQ(table.size(), 4u);
  EXPECT_EQ(table[0].trainee(), "Cleo");  // as its session.json says; others as their directories
  EXPECT_EQ(table[1].trainee(), "anna");
  EXPECT_EQ(table[1].passed, 2u);
  EXPECT_EQ(table[1].first_passed()->session, "2");
  EXPECT_EQ(table[1].last().session, "3");
  EXPECT_EQ(table[2].task(), "swelling, again");
  EXPECT_EQ(table[3].first_passed(), nullptr);
  const std::string csv = to_csv(table);
  EXPECT_NE(csv.find("anna,the apex,3,2,2,2026-11-02T10:00:00Z,3,2026-11-03T10:00:00Z,yes,1.00,-1.50,"),
            std::string::npos)
      << csv;
  EXPECT_NE(csv.find("bert,\"swelling, again\",1,1,2,"), std::string::npos) << csv;
  const std::string text = to_text(table);
  EXPECT_NE(text.find("needle D4 is 6 mm too deep"), std::string::npos) << text;
}

TEST_F(ClassTable, ThePageHasTheTableAndARecordOfEach) {
  const History sessions = load_class(folder / ".");
  const std::string all = to_html(sessions, "", "1.2.3");
  for (const char* part :
       {"<h1>Class</h1>", "passed 2026-11-02 (2 of 3); error 1.0 mm, -1.50 a session",
        "not passed, 1 session", "Record of completion: anna", "Record of completion: bert",
        "Passed 1 of the 2 exercises", "read by brachy 1.2.3", "at most &lt;2&gt; mm", "others: median"})
    EXPECT_NE(all.find(part), std::string::npos) << part;
  const std::string one = to_html(sessions, "anna", "1.2.3");
  EXPECT_EQ(one.find("bert"), std::string::npos);
  EXPECT_EQ(one.find("<h1>Class</h1>"), std::string::npos);
  EXPECT_NE(one.find("Passed 1 of the 1 exercise tried"), std::string::npos);
  EXPECT_THROW(to_html(sessions, "nobody", ""), UserError);
}

TEST_F(ClassTable, TheCohortIsTheLastSessionOfEachOther) {
  const History sessions = load_class(folder / ".");
  const History anna = load_history(folder / "anna");
  const std::vector<Trend> trends = trends_of(anna, {.cohort = &sessions});
  const auto error = std::ranges::find(trends, "mean_error_mm", &Trend::name);
  ASSERT_NE(error, trends.end());
  EXPECT_EQ(error->cohort.count, 2u);  // Cleo's 1 mm and Bert's 5 mm
  EXPECT_EQ(error->cohort.median, 3);
  EXPECT_EQ(error->cohort.first, 2);
  EXPECT_EQ(error->cohort.third, 4);
  const std::string text = to_text(anna, {.cohort = &sessions});
  EXPECT_NE(text.find("anna, the apex: 3 sessions"), std::string::npos) << text;
  EXPECT_NE(text.find("2026-11-02T10:00:00Z  passed"), std::string::npos) << text;
  EXPECT_NE(text.find("3.00 (2.00–4.00)"), std::string::npos) << text;
  EXPECT_NE(to_csv(anna).find(",the apex,2026-11-01T10:00:00Z,no,anna\n"), std::string::npos) << to_csv(anna);
}

TEST_F(ClassTable, TheToolWritesItsPageAndTable) {
  const std::string page = (folder / "class.html").string(), csv = (folder / "class.csv").string();
  ASSERT_TRUE(exited(run_brachy({"score", "--class", folder / "", "--out", page, "--csv", csv}), 0));
  EXPECT_NE(read_file(page).find("Record of completion: Cleo"), std::string::npos);
  EXPECT_TRUE(exited(run_brachy({"score", "--class", folder / "", "--trainee", "anna"}), 2))
      << "it needs --out";
  EXPECT_TRUE(exited(run_brachy({"score", folder / "loose", "--class", folder / ""}), 2));
  EXPECT_EQ(read_file(csv).find("trainee,task,sessions,passed"), 0u);
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", "--class", folder / "", "--trainee", "Zoe", "--out",
                                              (folder / "z.html").string()}),
                                  {"no session of trainee \"Zoe\"", "Cleo, anna, bert"}));
}

}  // namespace
}  // namespace brachy
