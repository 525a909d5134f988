#include "apps/lab/bench/long_cases.h"

#include "apps/bench/workload.h"

namespace brachy::bench {
namespace {

/// All of n × N × threads for psi31 at 12 mm; the other kernels and supports where the time allows.
std::vector<TickCase> ticks() {
  std::vector<TickCase> cases;
  const auto numbers = {1, 4, 10, 20, 30, 100, 300, 1000};
  for (const std::size_t N : {kPaperPoints, std::size_t{100'000}, std::size_t{1'000'000}})
    for (const std::size_t n : numbers)
      for (const int threads : {1, 2}) cases.push_back({N, n, "psi31", 12, threads});
  for (const std::string_view kernel : {"psi30", "psi32", "buhmann"}) {
    for (const std::size_t n : numbers) cases.push_back({kPaperPoints, n, kernel});
    for (const std::size_t n : {1, 4, 10, 20, 30, 100, 300}) cases.push_back({100'000, n, kernel});
    cases.push_back({1'000'000, 100, kernel});
  }
  for (const double support_mm : {6.0, 40.0})
    for (const std::string_view kernel : {"psi30", "psi31", "psi32", "buhmann"}) {
      for (const std::size_t n : numbers) cases.push_back({kPaperPoints, n, kernel, support_mm});
      cases.push_back({100'000, 100, kernel, support_mm});
      cases.push_back({1'000'000, 100, kernel, support_mm});
    }
  return cases;
}

}  // namespace

BenchCases long_cases() {
  return {.ticks = ticks(),
          .reaction_landmarks = {10, 30, 41, 60, 90, 100},
          .in_place = {{"rest_8", 8, 1},
                       {"rest_16", 17, 1},
                       {"rest_24", 25, 1},
                       {"stir_4", 4, 4},
                       {"stir_16", 16, 16}},
          .dose_points = 100'000,
          .dose_spacings_mm = {0.5, 1.0, 1.5, 2.0, 3.0, 5.0}};
}

}  // namespace brachy::bench
