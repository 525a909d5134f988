// The long form of the benchmarks, by the name that both forms have; times are not tested.
#include "test_paths.h"
#ifdef BRACHY_BENCH_BINARY
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

TEST(LongBench, RunsCasesThatTheShortFormHasNot) {
  TempFolder folder;
  const std::string file = (folder / "bench.json").string();
  const std::string only = "--benchmark_filter=^axial_stiffness/psi31/N:14560/n:10/";
  ASSERT_TRUE(exited(run_process({BRACHY_BENCH_BINARY, "--json", file, only}), 0));
  const nlohmann::json rows = nlohmann::json::parse(read_file(file)).at("rows");
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].at("case"), "axial_stiffness");
  EXPECT_EQ(rows[0].at("landmarks"), 10);
  ASSERT_TRUE(exited(run_process({BRACHY_BENCH_BINARY, "--quick", "--json", file, only}), 0));
  EXPECT_TRUE(nlohmann::json::parse(read_file(file)).at("rows").empty());
}

TEST(LongBench, RefusesATargetThatDoesNotExist) {
  EXPECT_TRUE(refused_in_one_line(run_process({BRACHY_BENCH_BINARY, "--simd=abacus"}), {"abacus", "avx2"}));
}

}  // namespace
}  // namespace brachy
#endif
