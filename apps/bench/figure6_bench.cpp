// The paper's figure 6: time against landmarks for its four kernels, solve and evaluation apart, one and several
// threads; the paper's method and this engine.
#include "apps/bench/benches.h"
#include "apps/bench/paper_baseline.h"
#include "apps/bench/rebuilt_tick.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"

namespace brachy::bench {
namespace {

void run_figure6(benchmark::State& state, Report& report, SimdTarget target, Row row) {
  const Tissue& tissue = phantom(row.points);
  LandmarkCycle ours(row.landmarks, true), papers = ours;
  RebuiltTick engine(tissue, row.kernel, row.support_mm, row.landmarks, target, row.threads);
  PaperBaseline paper(row.kernel, row.support_mm);
  std::vector<Vec3> u(tissue.size());
  const auto ms = time_in_turns(
      state, {{[&] { engine.solve(ours.positions(), ours.displacements()); }, [&] { ours.advance(); }},
              {[&] {
                 engine.cull(ours.positions());
                 engine.evaluate();
               },
               {},
               row.threads},
              {[&] { paper.solve(papers.positions(), papers.displacements()); }, [&] { papers.advance(); }},
              {[&] { paper.evaluate(tissue.rest_vertices, u); }},
              {[&] { paper.evaluate(tissue.rest_vertices, u, row.threads); }, {}, row.threads}});
  row.more["solve_ms"] = ms[0];
  row.more["evaluate_ms"] = ms[1];
  row.more["baseline_solve_ms"] = ms[2];
  row.more["baseline_evaluate_ms"] = row.threads == 1 ? ms[3] : ms[4];  // with as many threads as ours
  row.ms = ms[0] + ms[1];
  row.baseline_ms = ms[2] + ms[3];
  state.counters["ratio"] = row.ratio();
  report.rows.push_back(row);
}

}  // namespace

void add_figure6_benches(Report& report, const BenchOptions& options) {
  for (const int threads : {1, 2})
    for (const char* kernel : {"psi30", "psi31", "psi32", "buhmann"})
      for (const std::size_t n : {1, 4, 10, 20, 30, 100}) {
        Row row{.name = "figure6",
                .kernel = kernel,
                .points = kPaperPoints,
                .landmarks = n,
                .threads = threads,
                .moving = true};
        add_benchmark(report, name_of(row), [&report, target = options.target, row](benchmark::State& state) {
          run_figure6(state, report, target, row);
        });
      }
}

}  // namespace brachy::bench
