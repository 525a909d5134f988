#include "apps/score/history.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

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
  const auto trends = trends_of(history, nullptr);
  EXPECT_NEAR(trend(trends, "mean_error_mm").per_session, -1, 1e-9);
  EXPECT_NEAR(trend(trends, "d90_gy").per_session, 10, 1e-9);
  EXPECT_EQ(trend(trends, "d90_gy").last, 150);
  EXPECT_TRUE(std::isnan(trend(trends, "d90_gy").instructor));
}

TEST(History, IsComparedWithTheInstructorsMean) {
  const test::TempFolder trainee, instructor;
  write_session(trainee, "1", 3, 130);
  write_session(instructor, "1", 0.5, 160);
  write_session(instructor, "2", 1.5, 170);
  const History of_instructor = load_history(instructor / ".");
  const auto trends = trends_of(load_history(trainee / "."), &of_instructor);
  EXPECT_NEAR(trend(trends, "mean_error_mm").instructor, 1, 1e-9);
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
