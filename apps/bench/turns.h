#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <vector>

#include "apps/bench/report.h"

namespace brachy::bench {

/// Something to time: one call of `run`; `prepare`, if any, comes before each call and is not timed.
struct Work {
  std::function<void()> run;
  std::function<void()> prepare = {};
  int threads = 1;  ///< it uses
};

/// Median time of one call of each work, ms.
///
/// Machines are shared and drift, so the works take turns, one turn of each an iteration of `state`; only quotients of
/// times from one call of this function mean something. A turn is some 20 calls back to back (more where they are
/// short, fewer where they take long) and counts as their median: the caches and clocks of the work before affect a
/// turn's first call only. Of a work with one thread, time that other programs took from its core is not counted:
/// otherwise it would affect the long calls of a baseline more than our short ones.
std::vector<double> time_in_turns(benchmark::State& state, const std::vector<Work>& works);

/// The common case: times `ours` and `baseline` into `row`, and prints both beside the benchmark's name.
void time_row(benchmark::State& state, Row& row, const Work& ours, const Work& baseline);

/// "tick/psi31/N:14560/n:10/a:12/threads:1/moving": the name of a row's benchmark.
std::string name_of(const Row& row);

/// Registers `run` under `name`, which `report` remembers, with the number of turns every ratio is the median of.
template <class Run>
void add_benchmark(Report& report, const std::string& name, Run run) {
  report.benchmarks.push_back(name);
  constexpr int kTurns = 7;
  benchmark::RegisterBenchmark(name.c_str(), run)
      ->Iterations(kTurns)
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond);
}

}  // namespace brachy::bench
