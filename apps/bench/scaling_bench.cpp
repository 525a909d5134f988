// How a tick's time grows with points inside supports, and that it does not with points outside.
#include <random>

#include "apps/bench/benches.h"
#include "apps/bench/paper_baseline.h"
#include "apps/bench/rebuilt_tick.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"

namespace brachy::bench {
namespace {

constexpr std::size_t kLandmarks = 10;
constexpr double kSupport = 12;

/// Random points about the landmarks: exactly so many inside some support and outside all, as dense there as here, as a
/// larger organ around the same needle would have them.
Tissue scatter(std::span<const Vec3> landmarks, std::size_t inside, std::size_t outside) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3> points;
  // `count` points of the cube; returns how many it took.
  const auto add = [&](std::size_t count, bool are_inside, double half_side) {
    std::size_t tries = 0;
    for (std::size_t added = 0; added < count; ++tries) {
      const Vec3 X = half_side * Vec3(unit(random), unit(random), unit(random));
      if ((count_reach({&X, 1}, landmarks, kSupport).points > 0) != are_inside) continue;
      points.push_back(X);
      ++added;
    }
    return static_cast<double>(tries);
  };
  const double half_side = 20 + kSupport;  // holds every support
  const double tries = add(inside, true, half_side);
  add(outside, false, half_side * std::cbrt(static_cast<double>(inside + outside) / tries));
  return build_tissue({}, points);
}

void run_scattered(benchmark::State& state, Report& report, SimdTarget target, Row row, std::size_t inside) {
  const LandmarkCycle landmarks(kLandmarks, false);
  const auto p = landmarks.positions(), d = landmarks.displacements();
  const Tissue tissue = scatter(p, inside, row.points - inside);
  RebuiltTick engine(tissue, row.kernel, kSupport, kLandmarks, target);
  PaperBaseline paper(row.kernel, kSupport);
  std::vector<Vec3> u(tissue.size());
  const auto tick = [&] {
    engine.solve(p, d);
    engine.cull(p);
    engine.evaluate();
  };
  const auto paper_tick = [&] {
    paper.solve(p, d);
    paper.evaluate(tissue.rest_vertices, u);
  };
  time_row(state, row, {tick}, {paper_tick});
  row.more["points_inside"] = static_cast<double>(inside);
  row.more["pairs_inside"] = static_cast<double>(count_reach(tissue.rest_vertices, p, kSupport).pairs);
  report.rows.push_back(row);
}

}  // namespace

void add_scaling_benches(Report& report, const BenchOptions& options) {
  const auto add = [&](const char* name, std::size_t inside, std::size_t outside) {
    Row row{.name = name,
            .points = inside + outside,
            .landmarks = kLandmarks,
            .support_mm = kSupport,
            .moving = true};
    add_benchmark(name_of(row) + "/inside:" + std::to_string(inside),
                  [&report, target = options.target, row, inside](benchmark::State& state) {
                    run_scattered(state, report, target, row, inside);
                  });
  };
  for (const std::size_t inside : {1'000, 10'000, 100'000, 1'000'000}) add("inside", inside, 0);
  for (const std::size_t outside : {0, 10'000, 100'000, 1'000'000}) add("outside", 10'000, outside);
}

}  // namespace brachy::bench
