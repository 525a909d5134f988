// How a tick's time grows with points inside supports, and that it does not with points outside.
#include <algorithm>
#include <cmath>
#include <memory>
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
  add(outside, false, half_side * std::max(1.0, std::cbrt(static_cast<double>(inside + outside) / tries)));
  return build_tissue({}, points);
}

/// A tissue, and the tick rebuilt on it by both.
struct Scattered {
  Scattered(const LandmarkCycle& landmarks, std::size_t inside, std::size_t outside, SimdTarget target)
      : p(landmarks.positions()),
        d(landmarks.displacements()),
        tissue(scatter(p, inside, outside)),
        engine(tissue, "psi31", kSupport, kLandmarks, target),
        paper("psi31", kSupport),
        u(tissue.size()) {}

  void tick() {
    engine.solve(p, d);
    engine.cull(p);
    engine.evaluate();
  }
  void paper_tick() {
    paper.solve(p, d);
    paper.evaluate(tissue.rest_vertices, u);
  }

  std::span<const Vec3> p, d;
  Tissue tissue;
  RebuiltTick engine;
  PaperBaseline paper;
  std::vector<Vec3> u;
};

struct Counts {
  std::size_t inside, outside;
};

/// All sizes in turns, since their times are compared with each other.
void run_scattered(benchmark::State& state, Report& report, SimdTarget target, const std::string& name,
                   const std::vector<Counts>& sizes) {
  const LandmarkCycle landmarks(kLandmarks, false);
  std::vector<std::unique_ptr<Scattered>> sets;
  std::vector<Work> works;
  for (const Counts& c : sizes) {
    sets.push_back(std::make_unique<Scattered>(landmarks, c.inside, c.outside, target));
    works.push_back({[set = sets.back().get()] { set->tick(); }});
    works.push_back({[set = sets.back().get()] { set->paper_tick(); }});
  }
  const auto ms = time_in_turns(state, works);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    Row row{.name = name,
            .points = sets[i]->tissue.size(),
            .landmarks = kLandmarks,
            .support_mm = kSupport,
            .moving = true};
    row.ms = ms[2 * i];
    row.baseline_ms = ms[2 * i + 1];
    row.more["points_inside"] = static_cast<double>(sizes[i].inside);
    row.more["pairs_inside"] =
        static_cast<double>(count_reach(sets[i]->tissue.rest_vertices, sets[i]->p, kSupport).pairs);
    row.more["pairs_visited"] = static_cast<double>(sets[i]->engine.field().statistics().pairs);
    state.counters["ms_" + std::to_string(row.points)] = row.ms;
    report.rows.push_back(row);
  }
}

}  // namespace

void add_scaling_benches(Report& report, const BenchOptions& options) {
  const auto add = [&](const std::string& name, const std::vector<Counts>& sizes) {
    add_benchmark(report, name, [&report, target = options.target, name, sizes](benchmark::State& state) {
      run_scattered(state, report, target, name, sizes);
    });
  };
  add("inside", {{1'000, 0}, {10'000, 0}, {100'000, 0}, {1'000'000, 0}});
  add("outside", {{10'000, 0}, {10'000, 100'000}, {10'000, 1'000'000}});
}

}  // namespace brachy::bench
