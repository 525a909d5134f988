// Whole ticks, from landmarks to displacements of all points, as the daemon's thread computes them.
#include "apps/study/bench/benches.h"
#include "apps/study/bench/paper_baseline.h"
#include "apps/study/bench/turns.h"
#include "apps/study/bench/workload.h"

namespace brachy::bench {
namespace {

/// ScalarKernelField condenses over some ticks once landmarks are fixed, if its cost model favours that; ticks are
/// timed after it has finished.
void settle(ScalarKernelField& deformation, LandmarkCycle& cycle) {
  constexpr int kMostTicks = 500;
  for (int tick = 0; tick < kMostTicks && deformation.evaluation() != Evaluation::kCondensed; ++tick) {
    cycle.advance();
    deformation.update(cycle.positions(), cycle.displacements());
  }
}

void run_tick(benchmark::State& state, Report& report, SimdTarget target, Row row) {
  const Tissue& tissue = phantom(row.points);
  LandmarkCycle cycle(row.landmarks, row.moving);
  ScalarKernelField deformation(tissue, *find_kernel(row.kernel), row.support_mm,
                                {.target = target, .threads = row.threads, .max_landmarks = row.landmarks});
  PaperBaseline paper(row.kernel, row.support_mm);
  std::vector<Vec3> u(tissue.size());

  const auto tick = [&] { deformation.update(cycle.positions(), cycle.displacements()); };
  tick();
  if (!row.moving) settle(deformation, cycle);

  LandmarkCycle paper_cycle = cycle;
  const auto paper_tick = [&] {
    paper.solve(paper_cycle.positions(), paper_cycle.displacements());
    paper.evaluate(tissue.rest_vertices, u);
  };
  paper_tick();
  row.more["difference_mm"] = largest_difference_mm(tissue, deformation.blocks(), u);
  time_row(state, row, {tick, [&] { cycle.advance(); }, row.threads},
           {paper_tick, [&] { paper_cycle.advance(); }});

  const Reach reach = count_reach(tissue.rest_vertices, cycle.positions(), row.support_mm);
  row.more["pairs_inside"] = static_cast<double>(reach.pairs);
  row.more["points_inside"] = static_cast<double>(reach.points);
  row.more["condensed"] = deformation.evaluation() == Evaluation::kCondensed;
  report.rows.push_back(row);
}

struct Case {
  std::size_t points, landmarks;
  std::string_view kernel = "psi31";
  double support_mm = 12;
  int threads = 1;
};

/// The goals' cases, and those of the charts over n and N.
std::vector<Case> quick_cases() {
  std::vector<Case> cases;
  for (const std::size_t n : {1, 4, 10, 20, 30, 100, 300}) cases.push_back({kPaperPoints, n});
  cases.push_back({100'000, 100});
  cases.push_back({1'000'000, 100});
  cases.push_back({1'000'000, 100, "psi31", 12, 2});
  return cases;
}

/// All of n × N × threads for psi31 at 12 mm; the other kernels and supports where the time allows.
std::vector<Case> all_cases() {
  std::vector<Case> cases;
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

void add_tick_benches(Report& report, const BenchOptions& options) {
  for (const Case& c : options.is_quick ? quick_cases() : all_cases())
    for (const bool moving : {true, false}) {
      Row row{.name = "tick",
              .kernel = std::string(c.kernel),
              .points = c.points,
              .landmarks = c.landmarks,
              .support_mm = c.support_mm,
              .threads = c.threads,
              .moving = moving};
      const auto target = options.target;
      add_benchmark(report, name_of(row), [&report, target, row](benchmark::State& state) {
        run_tick(state, report, target, row);
      });
    }
}

}  // namespace brachy::bench
