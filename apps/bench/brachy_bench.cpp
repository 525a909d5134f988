// Google Benchmark of the engine beside the paper's way, in one run: compare the ratios, not the times.
#include <benchmark/benchmark.h>

#include "apps/bench/paper_baseline.h"
#include "core/field/block_field.h"
#include "core/rbf/rbf_system.h"
#include "core/scene/load_tissue.h"
#include "core/sim/simulator.h"

namespace brachy::bench {
namespace {

constexpr double kSupport = 12;  // mm

const Tissue& phantom() {
  static const Tissue tissue = load_tissue(Scene{}).tissue;
  return tissue;
}

struct Landmarks {
  std::vector<Vec3> positions, displacements;
};

/// A needle's landmarks (up to four, moved 5 mm inwards) and anchors spread evenly half way to the centre.
Landmarks landmarks(int n) {
  Landmarks L;
  const int contacts = n < 10 ? 1 : n < 20 ? 2 : 4;
  for (int i = 0; i < n; ++i) {
    if (i < contacts) {
      L.positions.push_back({4.0 * (i % 2), 4.0 * (i / 2), -20});
      L.displacements.push_back({0, 0, 5});
      continue;
    }
    const int k = i - contacts, m = n - contacts;
    const double z = 1 - (2.0 * k + 1) / m, r = std::sqrt(1 - z * z),
                 t = 2.399963229728653 * k;  // golden angle
    L.positions.push_back({12 * r * std::cos(t), 9 * r * std::sin(t), 10.5 * z});
    L.displacements.push_back(Vec3::Zero());
  }
  return L;
}

void BM_PaperTick(benchmark::State& state) {
  const Landmarks L = landmarks(static_cast<int>(state.range(0)));
  PaperBaseline paper(Wendland31{}, kSupport);
  std::vector<Vec3> u(phantom().size());
  for (auto _ : state) {
    paper.solve(L.positions, L.displacements);
    paper.evaluate(phantom().rest_vertices, u);
    benchmark::DoNotOptimize(u.data());
  }
}

void BM_EngineTick(benchmark::State& state) {
  const Landmarks L = landmarks(static_cast<int>(state.range(0)));
  RbfSystem system(Wendland31{}, kSupport, static_cast<int>(L.positions.size()));
  BlockField field(phantom(), Wendland31{}, kSupport, {.max_landmarks = L.positions.size()});
  std::vector<Vec3> weights(L.positions.size());
  for (auto _ : state) {
    if (!system.factorize(L.positions)) state.SkipWithError("singular");
    system.solve(L.displacements, weights);
    field.set_landmarks(L.positions);
    field.evaluate(weights);
    benchmark::DoNotOptimize(field.touched().data());
  }
}

void BM_SimulatorTickInserted(benchmark::State& state) {
  const Scene scene;
  Simulator simulator(scene, phantom());
  MeshState mesh = simulator.initial_state();
  NeedlePose pose;
  pose.present = true;
  pose.X_WN.p = {8, -4, -40};
  while (pose.X_WN.p.z() < 10) {
    pose.X_WN.p.z() += 0.2;
    simulator.step(pose, mesh);
  }
  int tick = 0;
  for (auto _ : state) {
    pose.X_WN.p.x() = 8 + 0.05 * (tick++ % 20);
    simulator.step(pose, mesh);
  }
  state.counters["landmarks"] = mesh.needle.landmark_count;
}

BENCHMARK(BM_PaperTick)->Arg(1)->Arg(10)->Arg(30)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_EngineTick)->Arg(1)->Arg(10)->Arg(30)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_SimulatorTickInserted)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace brachy::bench

BENCHMARK_MAIN();
