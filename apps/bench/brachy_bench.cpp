// The engine beside the paper's way and the machine's limits, in one run: compare the ratios, not the times.
//   brachy_bench [--quick] [--json=FILE] [--simd=TARGET] [Google Benchmark's options]
#include <benchmark/benchmark.h>

#include <cstdio>
#include <exception>
#include <string_view>

#include "apps/bench/benches.h"
#include "apps/bench/machine_limits.h"
#include "apps/bench/memory.h"

namespace {

/// Takes `name`, or what starts with it where it ends in "=", off the command line, which Google Benchmark reads after
/// us; what follows it, or nothing.
const char* take_option(int& argc, char** argv, std::string_view name) {
  const char* value = nullptr;
  int kept = 0;
  for (int i = 0; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (name.ends_with('=') ? argument.starts_with(name) : argument == name)
      value = argv[i] + name.size();
    else
      argv[kept++] = argv[i];
  }
  argc = kept;
  return value;
}

void run(int argc, char** argv) {
  using namespace brachy::bench;
  BenchOptions options;
  options.is_quick = take_option(argc, argv, "--quick");
  const char* json = take_option(argc, argv, "--json=");
  if (const char* simd = take_option(argc, argv, "--simd="))
    options.target = brachy::resolve_simd_target(simd);
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
  add_figure6_benches(report, options);
  benchmark::RunSpecifiedBenchmarks();
  report.others_load = others.share();

  for (const auto& [name, value] : report.limits) std::printf("limit   %-32s %.4g\n", name.c_str(), value);
  for (const auto& [name, value] : report.memory) std::printf("memory  %-32s %.4g\n", name.c_str(), value);
  print_goals(report);
  if (json) report.write_json(json);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "brachy_bench: %s\n", error.what());
    return 2;
  }
}
