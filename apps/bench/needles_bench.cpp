// A whole tick with three needles at work, each with 30 landmarks, all of them pushed on and drawn back at 12
// cm/s: ours is Simulator::step, the baseline the same with one needle. And one and four needles that bend, the
// baseline the same with rigid ones. The quantiles are of every tick's thread time, which no one else's load is part
// of.
#include <cmath>
#include <memory>

#include "apps/bench/benches.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"
#include "core/realtime/deadline.h"
#include "core/realtime/histogram.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"

namespace brachy::bench {
namespace {

constexpr double kStride = 0.6;  // mm a tick: 12 cm/s at 200 Hz, clinical (core/DESIGN.md, section 4)
constexpr double kStart = -50, kDeepest = 32;

/// `count` needles in, 8 mm apart; then all of them to and fro in their last millimetres.
class Insertion {
 public:
  Insertion(std::size_t count, const std::string& kernel, SimdTarget target, bool flexible = false)
      : simulator_(load_simulation_model(scene(count, kernel, target, flexible), body())),
        state_(simulator_.initial_state()),
        poses_(count) {
    for (double z = kStart; z < kDeepest; z += kStride) step_at(z);
  }
  void advance() {
    const auto phase = static_cast<double>(tick_++ % 16);
    z_ = kDeepest + kStride * (4 - std::abs(phase - 8));
  }
  void step() {
    const std::int64_t start = thread_cpu_ns();
    step_at(z_);
    times_.record(thread_cpu_ns() - start);
    flags_ |= state_.summary.step_flags;
  }
  const MeshState& state() const { return state_; }
  const Histogram& times() const { return times_; }
  std::uint32_t flags() const { return flags_; }

 private:
  /// Of the paper's number of points, and as deep as 30 landmarks take.
  static Scene body_scene() {
    Scene scene;
    scene.tissue.points = kPaperPoints;
    scene.tissue.phantom_size_mm = Vec3(84, 76, 90);
    scene.box.size_mm = Vec3::Constant(140);  // walls as far off as around the default gland
    return scene;
  }
  static const Tissue& body() {
    static const Tissue tissue = load_tissue(body_scene()).tissue;
    return tissue;
  }
  static Scene scene(std::size_t count, const std::string& kernel, SimdTarget target, bool flexible) {
    Scene scene = body_scene();
    scene.model.kernel = kernel;
    scene.engine.simd = to_string(target);
    scene.needle.count = count;
    scene.needle.flexible = flexible;
    scene.needle.guide_at = flexible ? "template" : "none";
    scene.contact.landmark_spacing_mm = 2.5;
    scene.contact.max_landmarks = 81;
    return scene;
  }
  void step_at(double z) { step_needles(simulator_, poses_, z, state_); }

  Simulator simulator_;
  MeshState state_;
  std::vector<NeedlePose> poses_;
  double z_ = kDeepest;
  std::uint64_t tick_ = 0;
  std::uint32_t flags_ = 0;
  Histogram times_;
};

void run_needles(benchmark::State& state, Report& report, SimdTarget target, Row row) {
  Insertion three(3, row.kernel, target), one(1, row.kernel, target);
  time_row(state, row, {[&] { three.step(); }, [&] { three.advance(); }},
           {[&] { one.step(); }, [&] { one.advance(); }});
  const auto ms = [](std::int64_t ns) { return 1e-6 * static_cast<double>(ns); };
  row.landmarks = three.state().summary.landmark_count;
  row.more["ticks"] = static_cast<double>(three.times().count());
  row.more["p99_ms"] = ms(three.times().quantile(0.99));
  row.more["max_ms"] = ms(three.times().max());
  row.more["unsettled"] = (three.flags() & (kStepSlipUnsettled | kStepSolveFailed)) != 0;
  state.counters["landmarks"] = static_cast<double>(row.landmarks);
  state.counters["p99_ms"] = row.more["p99_ms"];
  state.counters["max_ms"] = row.more["max_ms"];
  state.counters["unsettled"] = row.more["unsettled"];
  report.rows.push_back(row);
}

void run_bending(benchmark::State& state, Report& report, SimdTarget target, Row row, std::size_t count) {
  Insertion bending(count, row.kernel, target, true), rigid(count, row.kernel, target);
  time_row(state, row, {[&] { bending.step(); }, [&] { bending.advance(); }},
           {[&] { rigid.step(); }, [&] { rigid.advance(); }});
  const auto more_ms = [&](double quantile) {
    return 1e-6 * static_cast<double>(bending.times().quantile(quantile) - rigid.times().quantile(quantile));
  };
  row.landmarks = bending.state().summary.landmark_count;
  row.more["more_p50_ms"] = more_ms(0.5);
  row.more["more_p99_ms"] = more_ms(0.99);
  for (const char* name : {"more_p50_ms", "more_p99_ms"}) state.counters[name] = row.more[name];
  report.rows.push_back(row);
}

}  // namespace

void add_needles_benches(Report& report, const BenchOptions& options) {
  for (const char* kernel : {"psi31", "elastic"}) {
    const Row row{
        .name = "needles", .kernel = kernel, .points = kPaperPoints, .landmarks = 90, .moving = true};
    const auto target = options.target;
    add_benchmark(report, name_of(row), [&report, target, row](benchmark::State& state) {
      run_needles(state, report, target, row);
    });
  }
  for (const std::size_t count : {1u, 4u}) {
    const Row row{.name = "bending",
                  .kernel = "elastic",
                  .points = kPaperPoints,
                  .landmarks = 30 * count,
                  .moving = true};
    const auto target = options.target;
    add_benchmark(report, name_of(row), [&report, target, row, count](benchmark::State& state) {
      run_bending(state, report, target, row, count);
    });
  }
}

}  // namespace brachy::bench
