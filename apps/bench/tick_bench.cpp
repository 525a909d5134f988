// Whole ticks, from landmarks to displacements of all points, as the daemon's thread computes them.
#include <algorithm>

#include "apps/bench/benches.h"
#include "apps/bench/paper_baseline.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"

namespace brachy::bench {
namespace {

/// ScalarKernelField condenses over some ticks once landmarks are fixed, if its cost model favours that; ticks are
/// timed after it has finished.
template <class Tick>
void condense(const ScalarKernelField& deformation, LandmarkCycle& cycle, const Tick& tick) {
  constexpr int kMostTicks = 500;
  for (int i = 0; i < kMostTicks && deformation.evaluation() != Evaluation::kCondensed; ++i) {
    cycle.advance();
    tick();
  }
}

void run_tick(benchmark::State& state, Report& report, SimdTarget target, Row row) {
  const Tissue& tissue = phantom(row.points);
  LandmarkCycle cycle(row.landmarks, row.moving);
  ScalarKernelField deformation(tissue, *find_kernel(row.kernel), row.support_mm,
                                {.target = target, .threads = row.threads, .max_landmarks = row.landmarks});
  PaperBaseline paper(row.kernel, row.support_mm);
  std::vector<Vec3> u(tissue.size());

  LandmarkSet landmarks = LandmarkSet::of(cycle.positions(), cycle.displacements());
  const auto tick = [&] {
    if (row.moving) {
      landmarks.assign(cycle.positions(), cycle.displacements());
    } else {
      std::ranges::copy(cycle.displacements(), landmarks.displacements.begin());
      landmarks.settle();
    }
    deformation.update(landmarks);
  };
  tick();
  if (!row.moving) condense(deformation, cycle, tick);

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

}  // namespace

void add_tick_benches(Report& report, const BenchOptions& options) {
  for (const TickCase& c : options.cases.ticks)
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
