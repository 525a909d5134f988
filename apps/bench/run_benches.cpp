#include "apps/bench/run_benches.h"

#include <benchmark/benchmark.h>
#include <unistd.h>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "apps/bench/benches.h"
#include "apps/bench/machine_limits.h"
#include "apps/bench/memory.h"
#include "apps/terminal/progress.h"
#include "apps/terminal/terminal.h"

namespace brachy::bench {
namespace {

/// Removes "name=VALUE" or "name VALUE" from the command line, which Google Benchmark parses afterwards; the value, or
/// nothing.
std::optional<std::string> take_option(int& argc, char** argv, const std::string& name) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    int taken = 0;
    std::string value;
    if (argument.starts_with(name + "=")) {
      value = argument.substr(name.size() + 1);
      taken = 1;
    } else if (argument == name && i + 1 < argc) {
      value = argv[i + 1];
      taken = 2;
    }
    if (taken == 0) continue;
    std::copy(argv + i + taken, argv + argc, argv + i);
    argc -= taken;
    return value;
  }
  return std::nullopt;
}

/// Google Benchmark's table, with the remaining time on standard error.
class WithProgress : public benchmark::ConsoleReporter {
 public:
  explicit WithProgress(std::size_t count)
      : ConsoleReporter(is_drawable(STDOUT_FILENO) ? OO_Color : OO_None), count_(count) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    progress_.finish();
    ConsoleReporter::ReportRuns(runs);
    if (++done_ < count_) progress_.show_step(done_, count_, "benchmarks");
  }
  void Finalize() override {
    progress_.finish();
    ConsoleReporter::Finalize();
  }

 private:
  const std::size_t count_;
  std::size_t done_ = 0;
  Progress progress_{"bench"};
};

/// The number of benchmarks that --benchmark_filter selects.
std::size_t count_chosen(const std::vector<std::string>& names) {
  std::string filter = benchmark::GetBenchmarkFilter();
  if (filter.empty() || filter == "all") return names.size();
  const bool is_negative = filter.front() == '-';
  const std::regex chosen(is_negative ? filter.substr(1) : filter, std::regex::extended);
  return static_cast<std::size_t>(std::ranges::count_if(
      names, [&](const std::string& name) { return std::regex_search(name, chosen) != is_negative; }));
}

void run(int argc, char** argv, BenchCases cases) {
  BenchOptions options{.cases = std::move(cases)};
  const auto json = take_option(argc, argv, "--json");
  if (const auto simd = take_option(argc, argv, "--simd")) options.target = resolve_simd_target(*simd);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) std::exit(2);

  Report report;
  report.simd_target = to_string(options.target);
  report.machine = processor_name();
  const OthersLoad others;
  std::printf("brachy_bench: %s, simd %s; measuring the machine's limits and memory\n",
              report.machine.c_str(), report.simd_target.c_str());
  report.limits = measure_limits();
  report.memory = measure_memory();
  add_tick_benches(report, options);
  add_direct_benches(report, options);
  add_scaling_benches(report, options);
  add_system_benches(report, options);
  add_guard_benches(report, options);
  add_reactions_benches(report, options);
  add_needles_benches(report, options);
  add_resting_benches(report, options);
  add_organs_benches(report, options);
  add_dose_benches(report, options);
  add_ultrasound_benches(report, options);
  add_figure6_benches(report, options);
  WithProgress table(count_chosen(report.benchmarks));
  benchmark::RunSpecifiedBenchmarks(&table);
  report.others_load = others.share();

  for (const auto& [name, value] : report.limits) std::printf("limit   %-32s %.4g\n", name.c_str(), value);
  for (const auto& [name, value] : report.memory) std::printf("memory  %-32s %.4g\n", name.c_str(), value);
  print_goals(report);
  if (json) report.write_json(*json);
}

}  // namespace

int run_benches(int argc, char** argv, BenchCases cases) {
  try {
    run(argc, argv, std::move(cases));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "brachy_bench: %s\n", error.what());
    return 2;
  }
}

}  // namespace brachy::bench
