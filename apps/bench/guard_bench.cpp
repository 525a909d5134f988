// The cost of certificate and guard in a tick: ours is the guarded tick, the baseline the same field without it.
#include <memory>

#include "apps/bench/benches.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"
#include "core/models/guard/guarded_field.h"
#include "core/models/scalar_kernel/scalar_composition.h"

namespace brachy::bench {
namespace {

/// A shaft of n landmarks in the phantom, pushed along itself and aside; its tip moves on a little at every tick.
class PushedShaft {
 public:
  PushedShaft(std::size_t n, double push_mm) {
    std::vector<Vec3> positions;
    for (std::size_t i = 0; i < n; ++i)
      positions.emplace_back(
          8, -4, -20 + 35 * static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(n - 1, 1)));
    landmarks_.assign(positions, std::vector<Vec3>(n, Vec3(0.1 * push_mm, 0, push_mm)));
  }
  void advance() {
    landmarks_.positions.back().z() += (tick_++ % 16 < 8 ? 1e-3 : -1e-3);
    landmarks_.number();
    landmarks_.settle();
  }
  const LandmarkSet& landmarks() const { return landmarks_; }

 private:
  LandmarkSet landmarks_;
  int tick_ = 0;
};

void run_guard(benchmark::State& state, Report& report, SimdTarget target, Row row, double push_mm) {
  const Tissue& tissue = phantom(row.points);
  const Kernel kernel = *find_kernel(row.kernel);
  const BlockField::Options options{.target = target, .max_landmarks = row.landmarks};
  ScalarKernelField plain(tissue, kernel, row.support_mm, options);
  GuardedField guarded(
      tissue, std::make_unique<ScalarKernelField>(tissue, kernel, row.support_mm, options),
      std::make_unique<ScalarComposition>(tissue, kernel, row.support_mm, target, row.landmarks, 8),
      GuardSettings{});
  PushedShaft shaft(row.landmarks, push_mm), same(row.landmarks, push_mm);
  time_row(state, row, {[&] { guarded.update(shaft.landmarks()); }, [&] { shaft.advance(); }},
           {[&] { plain.update(same.landmarks()); }, [&] { same.advance(); }});
  row.more["push_mm"] = push_mm;
  row.more["added_ms"] = row.ms - row.baseline_ms;
  row.more["substeps"] = guarded.certificate().substeps;
  row.more["injective"] = guarded.certificate().verdict == Verdict::kInjective;
  state.counters["added_ms"] = row.ms - row.baseline_ms;
  state.counters["substeps"] = guarded.certificate().substeps;
  state.counters["injective"] = row.more["injective"];
  report.rows.push_back(row);
}

}  // namespace

void add_guard_benches(Report& report, const BenchOptions& options) {
  for (const std::size_t n : {1, 10, 30})
    for (const double push_mm : {1.5, 15.0}) {
      const Row row{.name = push_mm < 5 ? "guard" : "guard/far",
                    .points = kPaperPoints,
                    .landmarks = n,
                    .moving = true};
      const auto target = options.target;
      add_benchmark(report, name_of(row), [&report, target, row, push_mm](benchmark::State& state) {
        run_guard(state, report, target, row, push_mm);
      });
    }
}

}  // namespace brachy::bench
