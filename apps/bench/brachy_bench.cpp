// The engine beside the paper's method and the machine's limits, in one run: compare the ratios, not the times.
//   brachy_bench [--quick] [--json FILE] [--simd TARGET] [Google Benchmark's options]
// Without --quick it starts the laboratory's brachy_bench_long, which lies beside it.
#include <algorithm>
#include <cstdio>
#include <string_view>

#include "apps/bench/run_benches.h"
#include "apps/command_line/exec_sibling.h"
#include "core/base/error.h"

int main(int argc, char** argv) {
  char** end =
      std::remove_if(argv + 1, argv + argc, [](const char* a) { return std::string_view(a) == "--quick"; });
  if (end != argv + argc) {
    *end = nullptr;
    return brachy::bench::run_benches(static_cast<int>(end - argv), argv, brachy::bench::short_cases());
  }
  try {
    brachy::exec_sibling(
        "brachy_bench_long", "a run without --quick", argv,
        "build it with scripts/build.sh release brachy_bench_long (CMake option BRACHY_LAB)");
  } catch (const brachy::UserError& error) {
    std::fprintf(stderr, "brachy_bench: %s\n", error.what());
    return 2;
  }
}
