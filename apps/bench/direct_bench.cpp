// Direct evaluation alone: psi31 and Buhmann, alternating with the machine's fused multiply-adds.
#include "apps/bench/benches.h"
#include "apps/bench/machine_limits.h"
#include "apps/bench/paper_baseline.h"
#include "apps/bench/rebuilt_tick.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"

namespace brachy::bench {
namespace {

constexpr double kFlopsOfPair = 22;  // psi31: distance, its root, the polynomial, three multiply-adds

void run_direct(benchmark::State& state, Report& report, SimdTarget target, Row row) {
  const Tissue& tissue = phantom(row.points);
  const LandmarkCycle cycle(row.landmarks, false);
  RebuiltTick psi31(tissue, "psi31", row.support_mm, row.landmarks, target),
      buhmann(tissue, "buhmann", row.support_mm, row.landmarks, target);
  for (RebuiltTick* engine : {&psi31, &buhmann}) {
    engine->solve(cycle.positions(), cycle.displacements());
    engine->cull(cycle.positions());
  }
  PaperBaseline paper("psi31", row.support_mm), paper_buhmann("buhmann", row.support_mm);
  for (PaperBaseline* baseline : {&paper, &paper_buhmann})
    baseline->solve(cycle.positions(), cycle.displacements());
  std::vector<Vec3> u(tissue.size());

  const SimdTarget fastest = fastest_target();
  const double operations = run_multiply_adds(fastest);
  const auto ms = time_in_turns(state, {{[&] { psi31.evaluate(); }},
                                        {[&] { buhmann.evaluate(); }},
                                        {[&] { run_multiply_adds(fastest); }},
                                        {[&] { paper.evaluate(tissue.rest_vertices, u); }},
                                        {[&] { paper_buhmann.evaluate(tissue.rest_vertices, u); }}});
  const Reach reach = count_reach(tissue.rest_vertices, cycle.positions(), row.support_mm);
  const double peak = operations / ms[2];  // a ms
  row.more["pairs_inside"] = static_cast<double>(reach.pairs);
  row.more["points_inside"] = static_cast<double>(reach.points);
  row.more["pairs_visited"] = static_cast<double>(psi31.field().statistics().pairs);
  row.ms = ms[0];
  row.baseline_ms = ms[3];
  row.more["fma_share"] = kFlopsOfPair * static_cast<double>(reach.pairs) / ms[0] / peak;
  row.more["fma_gflops"] = peak * 1e-6;
  state.counters["fma_share"] = row.more["fma_share"];
  report.rows.push_back(row);

  row.kernel = "buhmann";
  row.ms = ms[1];
  row.baseline_ms = ms[4];
  row.more.erase("fma_share");  // its flops are others
  row.more["psi31_ms"] = ms[0];
  state.counters["buhmann_by_psi31"] = ms[1] / ms[0];
  report.rows.push_back(row);
}

}  // namespace

void add_direct_benches(Report& report, const BenchOptions& options) {
  for (const std::size_t points : {kPaperPoints, std::size_t{1'000'000}}) {
    Row row{.name = "direct", .points = points, .landmarks = 100, .moving = true};
    add_benchmark(report, name_of(row), [&report, target = options.target, row](benchmark::State& state) {
      run_direct(state, report, target, row);
    });
  }
}

}  // namespace brachy::bench
