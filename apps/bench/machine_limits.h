#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "core/base/simd/simd_target.h"

namespace brachy::bench {

/// A burst of independent single-precision fused multiply-adds in registers, on `target`: the peak rate.
/// Returns its floating-point operations; the time is the caller's.
double run_multiply_adds(SimdTarget target);

/// The target with the highest rate of multiply-adds here.
SimdTarget fastest_target();

/// The machine's limits, best of some tries: "fma_gflops" of one core (float, best target) and per target;
/// "write_gb_per_s" of one core to memory, and for as many bytes as the displacements of so many points, which may stay
/// in cache: "write_gb_per_s_14560_points", ….
std::map<std::string, double> measure_limits();

/// How much of the machine others used since construction: with that, times are worse than they could be and ratios
/// less certain. Linux's /proc/stat.
class OthersLoad {
 public:
  OthersLoad();
  double share() const;  ///< of all processors' time, 0 to 1

 private:
  double busy_s_ = 0, total_s_ = 0, own_s_ = 0;
};

/// "Intel(R) Xeon(R) Processor, 2 cores".
std::string processor_name();

}  // namespace brachy::bench
