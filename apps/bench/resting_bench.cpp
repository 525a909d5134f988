// A whole tick of the default scene with needles that rest in the gland, as catheters and locking needles do, and one
// that is stirred 5 mm about its place six times a second: ours is Simulator::step, the baseline the same with the
// stirred needle alone. And the same with all of them stirred. The quantiles are of every tick's thread time.
#include <cmath>
#include <numbers>

#include "apps/bench/benches.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"
#include "core/models/step_flag.h"
#include "core/realtime/deadline.h"
#include "core/realtime/histogram.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"

namespace brachy::bench {
namespace {

/// `count` needles in the gland, on the nearest holes of a template of 8 mm to its middle; `stirred` of them go round.
class InPlace {
 public:
  InPlace(std::size_t count, std::size_t stirred, const std::string& kernel, SimdTarget target)
      : simulator_(load_simulation_model(scene(count, kernel, target), body())),
        state_(simulator_.initial_state()),
        poses_(count),
        first_stirred_(count - stirred) {
    for (int tick = 0; tick < kInsertion; ++tick) step_at(static_cast<double>(tick) / kInsertion);
  }
  void advance() { ++tick_; }
  void step() {
    const std::int64_t start = thread_cpu_ns();
    step_at(1);
    times_.record(thread_cpu_ns() - start);
    late_ += (state_.summary.step_flags & kStepLate) != 0;
  }
  const MeshState& state() const { return state_; }
  const Histogram& times() const { return times_; }
  double late_share() const { return static_cast<double>(late_) / static_cast<double>(times_.count()); }

 private:
  static constexpr int kInsertion = 200;  // ticks
  static constexpr double kPitch = 8, kStart = -45, kDepth = 10, kRadius = 5, kHz = 6, kPeriod = 1.0 / 200;

  static Scene body_scene() {
    Scene scene;
    scene.tissue.points = kPaperPoints;
    return scene;
  }
  static const Tissue& body() {
    static const Tissue tissue = load_tissue(body_scene()).tissue;
    return tissue;
  }
  static Scene scene(std::size_t count, const std::string& kernel, SimdTarget target) {
    Scene scene = body_scene();
    scene.model.kernel = kernel;
    scene.engine.simd = to_string(target);
    scene.needle.count = count;
    return scene;
  }
  // Side by side in a square about the gland's axis, in template order; the last ones are stirred.
  Vec3 home(std::size_t needle) const {
    const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(poses_.size()))));
    const double middle = 0.5 * static_cast<double>(side - 1);
    return {kPitch * (static_cast<double>(needle % side) - middle),
            kPitch * (static_cast<double>(needle / side) - middle), 0};
  }
  void step_at(double inserted) {
    const double angle = 2 * std::numbers::pi * kHz * kPeriod * static_cast<double>(tick_);
    for (std::size_t n = 0; n < poses_.size(); ++n) {
      poses_[n].present = true;
      poses_[n].X_WN.p = home(n) + (kStart + inserted * (kDepth - kStart)) * Vec3::UnitZ();
      if (inserted == 1 && n >= first_stirred_)
        poses_[n].X_WN.p += kRadius * Vec3(std::sin(angle), 1 - std::cos(angle), 0);
    }
    simulator_.step(poses_, state_);
  }

  Simulator simulator_;
  MeshState state_;
  std::vector<NeedlePose> poses_;
  std::size_t first_stirred_;
  std::uint64_t tick_ = 0, late_ = 0;
  Histogram times_;
};

void run_in_place(benchmark::State& state, Report& report, SimdTarget target, Row row, std::size_t count,
                  std::size_t stirred) {
  InPlace many(count, stirred, row.kernel, target), one(1, 1, row.kernel, target);
  time_row(state, row, {[&] { many.step(); }, [&] { many.advance(); }},
           {[&] { one.step(); }, [&] { one.advance(); }});
  const auto ms = [](std::int64_t ns) { return 1e-6 * static_cast<double>(ns); };
  row.landmarks = many.state().summary.landmark_count;
  row.more["p99_ms"] = ms(many.times().quantile(0.99));
  row.more["max_ms"] = ms(many.times().max());
  row.more["late_share"] = many.late_share();
  state.counters["landmarks"] = static_cast<double>(row.landmarks);
  for (const auto& [name, value] : row.more) state.counters[name] = value;
  report.rows.push_back(row);
}

}  // namespace

void add_resting_benches(Report& report, const BenchOptions& options) {
  for (const char* kernel : {"psi31", "elastic"})
    for (const InPlaceCase& c : options.cases.in_place) {
      const Row row{.name = std::string(c.name),
                    .kernel = kernel,
                    .points = kPaperPoints,
                    .landmarks = c.count,
                    .moving = true};
      const auto target = options.target;
      add_benchmark(report, name_of(row), [&report, target, row, c](benchmark::State& state) {
        run_in_place(state, report, target, row, c.count, c.stirred);
      });
    }
}

}  // namespace brachy::bench
