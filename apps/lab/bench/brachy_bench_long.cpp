// The long form of the benchmarks: what `brachy_bench` starts unless it is told --quick.
//   brachy_bench_long [--json FILE] [--simd TARGET] [Google Benchmark's options]
#include "apps/bench/run_benches.h"
#include "apps/lab/bench/long_cases.h"

int main(int argc, char** argv) {
  return brachy::bench::run_benches(argc, argv, brachy::bench::long_cases());
}
