#include "apps/bench/turns.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "apps/reports/timing.h"

namespace brachy::bench {
namespace {

double call_ms(const Work& work) {
  if (work.prepare) work.prepare();
  const double cpu_start = thread_cpu_ms();  // outside the other clock: it takes longer to read
  const auto start = std::chrono::steady_clock::now();
  work.run();
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return work.threads == 1 ? std::min(ms, thread_cpu_ms() - cpu_start) : ms;
}

int calls_in_a_turn(const Work& work) {
  constexpr double kLeastMs = 5, kMostMs = 200;
  constexpr int kCalls = 20, kMostCalls = 500;
  call_ms(work);  // caches, page faults
  const double ms = call_ms(work);
  const int wanted = static_cast<int>(std::clamp(kLeastMs / ms, double{kCalls}, double{kMostCalls}));
  return std::max(1, std::min(wanted, static_cast<int>(kMostMs / ms)));
}

}  // namespace

std::vector<double> time_in_turns(benchmark::State& state, const std::vector<Work>& works) {
  std::vector<int> calls(works.size());
  std::ranges::transform(works, calls.begin(), calls_in_a_turn);
  std::vector<std::vector<double>> turns(works.size());
  for ([[maybe_unused]] auto _ : state) {
    for (std::size_t w = 0; w < works.size(); ++w) {
      std::vector<double> times(static_cast<std::size_t>(calls[w]));
      for (double& ms : times) ms = call_ms(works[w]);
      turns[w].push_back(median(std::move(times)));
    }
    state.SetIterationTime(turns[0].back() * 1e-3);
  }
  std::vector<double> medians(works.size());
  std::ranges::transform(turns, medians.begin(), median);
  return medians;
}

void time_row(benchmark::State& state, Row& row, const Work& ours, const Work& baseline) {
  const auto ms = time_in_turns(state, {ours, baseline});
  row.ms = ms[0];
  row.baseline_ms = ms[1];
  state.counters["median_ms"] = row.ms;
  state.counters["baseline_ms"] = row.baseline_ms;
  state.counters["ratio"] = row.ratio();
}

std::string name_of(const Row& row) {
  return row.name + "/" + row.kernel + "/N:" + std::to_string(row.points) +
         "/n:" + std::to_string(row.landmarks) + "/a:" + std::to_string(std::lround(row.support_mm)) +
         "/threads:" + std::to_string(row.threads) + (row.moving ? "/moving" : "/fixed");
}

}  // namespace brachy::bench
