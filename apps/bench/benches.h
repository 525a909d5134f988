#pragma once

#include "apps/bench/bench_cases.h"
#include "apps/bench/report.h"
#include "core/base/simd/simd_target.h"

namespace brachy::bench {

struct BenchOptions {
  BenchCases cases;
  SimdTarget target = best_simd_target();
};

// Each registers its benchmarks, which add their rows to `report` as they run. Both arguments must outlive the run.
void add_tick_benches(Report& report, const BenchOptions& options);  ///< whole ticks, moving and fixed
void add_direct_benches(Report& report,
                        const BenchOptions& options);  ///< direct evaluation, against the FMA peak
void add_scaling_benches(Report& report,
                         const BenchOptions& options);                 ///< points inside and outside supports
void add_system_benches(Report& report, const BenchOptions& options);  ///< the landmark system by itself
void add_guard_benches(Report& report,
                       const BenchOptions& options);  ///< the cost of certificate and guard in a tick
void add_reactions_benches(Report& report,
                           const BenchOptions& options);  ///< the evaluations of a field by contact mechanics
void add_needles_benches(Report& report,
                         const BenchOptions& options);  ///< whole ticks with three needles at work
void add_resting_benches(Report& report,
                         const BenchOptions& options);  ///< whole ticks with many needles in the gland
void add_organs_benches(Report& report,
                        const BenchOptions& options);  ///< what the test against organs adds to a tick
void add_dose_benches(Report& report,
                      const BenchOptions& options);  ///< a seed on the dose grid, DVH, and the grid's spacing
void add_ultrasound_benches(Report& report,
                            const BenchOptions& options);               ///< images, with needles and seeds
void add_figure6_benches(Report& report, const BenchOptions& options);  ///< the paper's figure 6

}  // namespace brachy::bench
