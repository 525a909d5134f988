#pragma once

#include "apps/bench/bench_cases.h"

namespace brachy::bench {

/// Runs the benchmarks of `cases` by a command line with --json FILE, --simd TARGET and Google Benchmark's options, and
/// prints table, limits and goals. Returns the exit code: 0, or 2 after one line on standard error.
int run_benches(int argc, char** argv, BenchCases cases);

}  // namespace brachy::bench
