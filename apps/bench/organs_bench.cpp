// What testing needles against the organs adds to a tick: three needles of the default scene, the middle one through
// the urethra, to and fro at 12 cm/s. The baseline is the same tick of a scene without organs. On psi31, whose ticks
// are the shortest: what is added is the same on every model. `added_…` is of the differences tick by tick, each the
// least of 20 rounds.
#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

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

constexpr std::size_t kNeedles = 3;
constexpr double kStrideMm = 0.6;  // a tick: 12 cm/s at 200 Hz, clinical (core/DESIGN.md, section 4)
constexpr double kFromMm = -40, kToMm = 20;
constexpr int kTicksARound = 2 * static_cast<int>((kToMm - kFromMm) / kStrideMm + 0.5), kRounds = 20;

class Passes {
 public:
  explicit Passes(std::shared_ptr<const SimulationModel> model)
      : simulator_(std::move(model)), state_(simulator_.initial_state()), poses_(kNeedles) {}
  void advance() {
    const int half = kTicksARound / 2, at = ++tick_ % kTicksARound;
    z_ = kFromMm + kStrideMm * (at < half ? at : kTicksARound - at);
  }
  std::int64_t step() {
    const std::int64_t start = thread_cpu_ns();
    step_needles(simulator_, poses_, z_, state_);
    return thread_cpu_ns() - start;
  }
  std::uint64_t passes() const {
    std::uint64_t sum = 0;
    for (const OrganContact& contact : state_.needles.organ_contacts) sum += contact.passes;
    return sum;
  }

 private:
  Simulator simulator_;
  MeshState state_;
  std::vector<NeedlePose> poses_;
  double z_ = kFromMm;
  int tick_ = 0;
};

void run_organs(benchmark::State& state, Report& report, SimdTarget target, Row row) {
  Scene scene;
  scene.model.kernel = row.kernel;
  scene.engine.simd = to_string(target);
  scene.needle.count = kNeedles;
  const auto with = load_simulation_model(scene, load_tissue(scene).tissue);
  const auto without =
      std::make_shared<const SimulationModel>(with->tissue, with->deformation, with->needle_tissues,
                                              with->settings, with->plan, std::vector<TestedOrgan>{});
  Passes tested(with), untested(without);
  time_row(state, row, {[&] { tested.step(); }, [&] { tested.advance(); }},
           {[&] { untested.step(); }, [&] { untested.advance(); }});
  // A tick of the way to and fro does the same work in every round; the least of its times is without other programs'.
  Passes a(with), b(without);
  constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
  std::vector<std::int64_t> a_ns(kTicksARound, kNone), b_ns(kTicksARound, kNone);
  for (int tick = 0; tick < kRounds * kTicksARound; ++tick) {
    const auto at = static_cast<std::size_t>(tick % kTicksARound);
    a.advance();
    b.advance();
    b_ns[at] = std::min(b_ns[at], b.step());
    a_ns[at] = std::min(a_ns[at], a.step());
  }
  Histogram added;
  for (std::size_t i = 0; i < kTicksARound; ++i) added.record(std::max<std::int64_t>(0, a_ns[i] - b_ns[i]));
  row.more["ticks"] = kRounds * kTicksARound;
  row.more["passes"] = static_cast<double>(a.passes());
  row.more["added_p50_ms"] = 1e-6 * static_cast<double>(added.quantile(0.5));
  row.more["added_p99_ms"] = 1e-6 * static_cast<double>(added.quantile(0.99));
  for (const char* name : {"passes", "added_p50_ms", "added_p99_ms"}) state.counters[name] = row.more[name];
  report.rows.push_back(row);
}

}  // namespace

void add_organs_benches(Report& report, const BenchOptions& options) {
  const Row row{.name = "organs", .kernel = "psi31", .points = Scene{}.tissue.points};
  const auto target = options.target;
  add_benchmark(report, name_of(row),
                [&report, target, row](benchmark::State& state) { run_organs(state, report, target, row); });
}

}  // namespace brachy::bench
