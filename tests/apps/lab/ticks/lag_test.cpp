// The measurement of `brachy lag`, and the command end to end.
#include "apps/lab/ticks/lag.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/apps_testing.h"

namespace brachy::test {
namespace {

TEST(Lag, OfOneNeedleThatIsInsertedThereIsNone) {
  const LagRow row = measure_lag({.name = "few points", .is_inserted = true, .rate_hz = 100, .points = 2000});
  EXPECT_EQ(row.ticks, 120u);
  EXPECT_GT(row.landmarks, 4u);
  EXPECT_EQ(row.max_mm, 0);
  EXPECT_EQ(row.told_mm, 0);
  EXPECT_EQ(row.late, 0u);
  EXPECT_EQ(row.clamped, 0u);
  EXPECT_LT(row.missed_mm, 0.01);
}

TEST(Lag, OfManyIsFoundAndToldAndAtMostAsFarAsTheyGo) {
  const LagRow row = measure_lag({.name = "many", .moving = 16, .rate_hz = 400, .points = 4000});
  EXPECT_GT(row.late, 0u);
  EXPECT_GT(row.max_mm, 0);
  EXPECT_GT(row.told_mm, 0.1 * row.max_mm);
  EXPECT_LT(row.max_mm, 10) << "their way from side to side";
  EXPECT_LE(row.mean_mm, row.p99_mm);
  EXPECT_LE(row.p99_mm, row.max_mm);
  EXPECT_LT(row.missed_mm, 0.01);
}

TEST(Lag, TheCommandWritesItsRowsAndWhatADaemonNeeds) {
  const TempFolder folder;
  const auto json = folder / "lag.json";
  const Ended ended = run_brachy({"lag", "--scenarios", "1_inserted_1khz", "--json", json.string(),
                                  "--daemon-files", (folder / "files").string()});
  ASSERT_TRUE(exited(ended, 0));
  const auto rows = nlohmann::json::parse(read_file(json));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].at("scenario"), "1_inserted_1khz");
  EXPECT_NE(ended.out.find("| 1_inserted_1khz |"), std::string::npos) << ended.out;
  const auto checked = run_brachyd({"--check-config", (folder / "files" / "1_inserted_1khz.toml").string()});
  EXPECT_TRUE(exited(checked, 0));
  EXPECT_NE(read_file(folder / "files" / "1_inserted_1khz.csv").find("t_s,m00"), std::string::npos);
  EXPECT_TRUE(exited(run_brachy({"lag", "--scenarios", "17"}), 2));
}

}  // namespace
}  // namespace brachy::test
