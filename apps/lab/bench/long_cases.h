#pragma once

#include "apps/bench/bench_cases.h"

namespace brachy::bench {

/// All sizes, kernels, supports and spacings, in some twenty minutes.
BenchCases long_cases();

}  // namespace brachy::bench
