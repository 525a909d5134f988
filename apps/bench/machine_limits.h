#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "core/field/simd_target.h"

namespace brachy::bench {

/// A burst of independent single-precision fused multiply-adds in registers, on `target`: nothing computes faster.
/// Returns its floating-point operations; the time is the caller's.
double run_multiply_adds(SimdTarget target);

/// The target with the highest rate of multiply-adds here.
SimdTarget fastest_target();

/// The machine's limits, best of some tries: "fma_gflops" of one core (float, best target) and per target;
/// "write_gb_per_s" of one core to memory; "write_cached_gb_per_s" where the positions of 14,560 points stay in cache.
std::map<std::string, double> measure_limits();

}  // namespace brachy::bench
