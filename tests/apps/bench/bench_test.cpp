// The output of brachy_bench, on its smallest case; times are not tested.
#include "test_paths.h"
#ifdef BRACHY_BENCH_BINARY
#include <cmath>
#include <set>

#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;
using Json = nlohmann::json;

TEST(Bench, WritesLimitsAndRowsOfWhatItRan) {
  TempFolder folder;
  const std::string file = (folder / "bench.json").string();
  const Ended ended = run_process({BRACHY_BENCH_BINARY, "--quick", "--simd=generic", "--json", file,
                                   "--benchmark_filter=^tick/psi31/N:14560/n:10/"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.out.find("simd generic"), std::string::npos);

  const Json bench = Json::parse(read_file(file));
  EXPECT_EQ(bench["simd"], "generic");
  for (const char* limit : {"fma_gflops", "write_gb_per_s"})
    EXPECT_GT(bench["limits"].at(limit), 0.0) << limit;
  EXPECT_GT(bench["memory"].at("simulator_bytes_per_point"), 0.0);

  std::set<bool> moving;
  for (const Json& row : bench["rows"]) {
    EXPECT_EQ(row.at("case"), "tick");
    EXPECT_EQ(row.at("kernel"), "psi31");
    EXPECT_EQ(row.at("points"), 14560);
    EXPECT_EQ(row.at("landmarks"), 10);
    EXPECT_EQ(row.at("support_mm"), 12);
    EXPECT_EQ(row.at("threads"), 1);
    EXPECT_GT(row.at("ms"), 0.0);
    EXPECT_GT(row.at("baseline_ms"), 0.0);
    EXPECT_DOUBLE_EQ(row.at("ratio"), row.at("baseline_ms").get<double>() / row.at("ms").get<double>());
    EXPECT_LT(row.at("difference_mm"), 2e-5) << "the engine's field is not the baseline's";
    moving.insert(row.at("moving").get<bool>());
  }
  EXPECT_EQ(bench["rows"].size(), 2u);
  EXPECT_EQ(moving.size(), 2u);
  EXPECT_FALSE(bench["goals"].empty());
}

TEST(Bench, SaysHowFarDoseOnAGridIsOff) {
  TempFolder folder;
  const std::string file = (folder / "bench.json").string();
  ASSERT_TRUE(exited(run_process({BRACHY_BENCH_BINARY, "--quick", "--json", file,
                                  "--benchmark_filter=^dose/(seed|evaluate|spacing/3.0)"}),
                     0));
  std::set<std::string> cases;
  const Json bench = Json::parse(read_file(file));
  for (const Json& row : bench["rows"]) {
    const std::string name = row.at("case");
    cases.insert(name);
    EXPECT_GT(row.at("ms"), 0.0) << name;
    EXPECT_GT(row.at("baseline_ms"), 0.0) << name;
    if (name == "dose/seed") {
      EXPECT_EQ(row.at("points"), 61 * 61 * 61);
      EXPECT_LT(row.at("largest_error_percent"), 0.05) << "the grid is not the exact sum";
    }
    if (name == "dose/spacing") {
      EXPECT_EQ(row.at("spacing_mm"), 3);
      // Both against 10⁴ random points, which have an error of 0.3 % themselves.
      EXPECT_LT(std::abs(row.at("v100_error_percent").get<double>()), 2);
      EXPECT_LT(std::abs(row.at("d90_error_percent").get<double>()), 2);
      EXPECT_GT(row.at("mean_error_percent"), 0.0);
    }
  }
  EXPECT_EQ(cases, (std::set<std::string>{"dose/seed", "dose/evaluate", "dose/spacing"}));
}

TEST(Bench, RefusesATargetThatDoesNotExist) {
  EXPECT_TRUE(refused_in_one_line(run_process({BRACHY_BENCH_BINARY, "--quick", "--simd=abacus"}),
                                  {"abacus", "avx2"}));
}

TEST(Bench, WithoutTheLaboratorysProgramALongRunIsRefusedWithTheFix) {
  TempFolder folder;
  std::filesystem::copy_file(BRACHY_BENCH_BINARY, folder / "brachy_bench");
  EXPECT_TRUE(
      refused_in_one_line(run_process({(folder / "brachy_bench").string()}),
                          {"a run without --quick needs ", (folder / "brachy_bench_long").string(),
                           "build it with scripts/build.sh release brachy_bench_long", "BRACHY_LAB"}));
}

}  // namespace
}  // namespace brachy
#endif
