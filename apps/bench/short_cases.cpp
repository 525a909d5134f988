#include "apps/bench/bench_cases.h"
#include "apps/bench/workload.h"

namespace brachy::bench {
namespace {

/// The goals' cases, and those of the charts over n and N.
std::vector<TickCase> ticks() {
  std::vector<TickCase> cases;
  for (const std::size_t n : {1, 4, 10, 20, 30, 100, 300}) cases.push_back({kPaperPoints, n});
  cases.push_back({100'000, 100});
  cases.push_back({1'000'000, 100});
  cases.push_back({1'000'000, 100, "psi31", 12, 2});
  return cases;
}

}  // namespace

BenchCases short_cases() {
  return {.ticks = ticks(),
          .reaction_landmarks = {30, 90},
          .in_place = {{"rest_16", 17, 1}},
          .dose_points = 10'000,
          .dose_spacings_mm = {1.0, 1.5, 2.0, 3.0, 5.0}};
}

}  // namespace brachy::bench
