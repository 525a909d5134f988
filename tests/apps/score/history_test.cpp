#include "apps/score/history.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>

#include "apps/session/session_manifest.h"
#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

void write_session(const test::TempFolder& folder, const std::string& name, double error_mm, double d90_gy) {
  std::filesystem::create_directories(folder / name);
  folder.write(
      name + "/report.json",
      R"({"findings":[{"text":"a"}],"structures_entered":[{"structure":"urethra","passes":2}],)"
      R"("seeds":{"by_position":{"placed":70,"missing":[1,2],"extra":[],"rest_error":{"total_mm":{"mean":)" +
          std::to_string(error_mm) + R"(},"axial_mm":{"mean":1}}}},)" +
          R"("needles":{"total":{"elapsed_time_s":600,"passes":25}},)" +
          R"("dose":{"rest":{"structures":[{"name":"prostate","d90_gy":)" + std::to_string(d90_gy) +
          R"(,"v100_percent":92}]}}})");
}

const Trend& trend(const std::vector<Trend>& trends, const std::string& name) {
  return *std::ranges::find(trends, name, &Trend::name);
}

TEST(History, SessionsInTheOrderOfTheirNamesWithTheirCourse) {
  const test::TempFolder folder;
  write_session(folder, "03", 1, 150);
  write_session(folder, "01", 3, 130);
  write_session(folder, "02", 2, 140);
  const History history = load_history(folder / ".");
  ASSERT_EQ(history.rows.size(), 3u);
  EXPECT_EQ(history.rows[0].session, "01");
  EXPECT_EQ(history.rows[0].missing, 2);
  EXPECT_EQ(history.rows[0].organ_passes, 2);
  EXPECT_TRUE(std::isnan(history.rows[0].urethra_d30_gy));
  const auto trends = trends_of(history, {});
  EXPECT_NEAR(trend(trends, "mean_error_mm").per_session, -1, 1e-9);
  EXPECT_NEAR(trend(trends, "d90_gy").per_session, 10, 1e-9);
  EXPECT_EQ(trend(trends, "d90_gy").last, 150);
  EXPECT_EQ(trend(trends, "d90_gy").instructor.count, 0u);
}

/// A session of an exercise, which began at a time; "": computed offline.
void write_manifest(const test::TempFolder& folder, const std::string& name, const std::string& exercise,
                    const std::string& began) {
  SessionManifest manifest;
  if (!exercise.empty()) manifest.exercise = ManifestText{"e.toml", "name = \"" + exercise + "\"\n"};
  if (!began.empty()) manifest.runs = {{"1", began, "", 0}};
  folder.write(name + "/session.json", to_json(manifest));
}

TEST(History, NumbersInNamesCountAsNumbers) {
  const test::TempFolder folder;
  for (const char* name : {"1", "10", "11", "2", "run 9b", "run 09a", "run 100"})
    write_session(folder, name, 1, 150);
  std::vector<std::string> names;
  for (const HistoryRow& row : load_history(folder / ".").rows) names.push_back(row.session);
  EXPECT_EQ(names, (std::vector<std::string>{"1", "2", "10", "11", "run 09a", "run 9b", "run 100"}));
}

TEST(History, ExercisesAreToldApartAndSortedByTheirTimes) {
  const test::TempFolder folder;
  const auto add = [&](const std::string& name, const std::string& exercise, const std::string& began,
                       double d90_gy) {
    write_session(folder, name, 1, d90_gy);
    write_manifest(folder, name, exercise, began);
  };
  add("a", "the apex", "2026-11-03T10:00:00Z", 150);
  add("b", "the apex", "2026-11-01T10:00:00Z", 130);
  add("c", "swelling", "2026-11-02T10:00:00Z", 100);
  add("d", "the apex", "2026-11-02T10:00:00Z", 140);
  add("e", "swelling", "2026-11-04T10:00:00Z", 90);
  const History history = load_history(folder / ".");
  const std::vector<History> tasks = by_task(history);
  ASSERT_EQ(tasks.size(), 2u);
  EXPECT_EQ(tasks[0].rows[0].task, "swelling");
  EXPECT_NEAR(trend(trends_of(tasks[0], {}), "d90_gy").per_session, -10, 1e-9);
  EXPECT_NEAR(trend(trends_of(tasks[1], {}), "d90_gy").per_session, 10, 1e-9);
  EXPECT_EQ(tasks[1].rows[0].session, "b");
  const std::string text = to_text(history, {});
  EXPECT_NE(text.find("the apex: 3 sessions"), std::string::npos) << text;
  EXPECT_NE(to_csv(history).find(",the apex,2026-11-01T10:00:00Z,"), std::string::npos) << to_csv(history);
  // Of an instructor only the same exercise counts.
  const test::TempFolder instructor;
  write_session(instructor, "1", 1, 160);
  write_manifest(instructor, "1", "the apex", "");
  const History of_instructor = load_history(instructor / ".");
  const std::string compared = to_text(history, {.instructor = &of_instructor});
  EXPECT_EQ(compared.find("160.00"), compared.rfind("160.00")) << compared;
  EXPECT_NE(compared.find("160.00"), std::string::npos) << compared;
}

TEST(History, ATrapIsLeftOutWithTheReason) {
  const test::TempFolder folder;
  write_session(folder, "1", 1, 150);
  std::filesystem::create_directories(folder / "2");
  ASSERT_EQ(::mkfifo((folder / "2/report.json").c_str(), 0600), 0);
  write_session(folder, "3", 1, 150);
  std::filesystem::create_symlink("/dev/zero", folder / "3/session.json");
  const History history = load_history(folder / ".");
  EXPECT_EQ(history.rows.size(), 1u);
  ASSERT_EQ(history.remarks.size(), 2u);
  EXPECT_NE(history.remarks[0].find("a FIFO"), std::string::npos) << history.remarks[0];
  EXPECT_NE(history.remarks[1].find("a link"), std::string::npos) << history.remarks[1];
}

TEST(History, IsComparedWithTheInstructorsMedian) {
  const test::TempFolder trainee, instructor;
  write_session(trainee, "1", 3, 130);
  write_session(instructor, "1", 0.5, 160);
  write_session(instructor, "2", 1.5, 170);
  const History of_instructor = load_history(instructor / ".");
  const auto trends = trends_of(load_history(trainee / "."), {.instructor = &of_instructor});
  EXPECT_NEAR(trend(trends, "mean_error_mm").instructor.median, 1, 1e-9);
  EXPECT_TRUE(std::isnan(trend(trends, "mean_error_mm").per_session));  // one session has no course
}

TEST(History, TheCsvHasARowForEachSessionAndLeavesTheUnknownEmpty) {
  const test::TempFolder folder;
  write_session(folder, "a,b", 2, 140);
  const std::string csv = to_csv(load_history(folder / "."));
  EXPECT_EQ(csv.substr(0, csv.find('\n')).find("session,mean_error_mm"), 0u) << csv;
  EXPECT_NE(csv.find("\"a,b\",2.0000"), std::string::npos) << csv;
  EXPECT_NE(csv.find(",,"), std::string::npos) << csv;
}

TEST(History, WhatIsNotScoredIsSaidAndAFolderWithoutAnyRefused) {
  const test::TempFolder folder;
  std::filesystem::create_directories(folder / "unscored");
  EXPECT_THROW(load_history(folder / "."), UserError);
  EXPECT_THROW(load_history(folder / "none"), UserError);
  write_session(folder, "scored", 2, 140);
  const History history = load_history(folder / ".");
  ASSERT_EQ(history.remarks.size(), 1u);
  EXPECT_NE(history.remarks[0].find("unscored"), std::string::npos);
}

}  // namespace
}  // namespace brachy
