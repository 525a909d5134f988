#pragma once

#include <algorithm>
#include <vector>

#include "core/realtime/deadline.h"

namespace brachy {

/// Processor time of this thread, ms.
inline double thread_cpu_ms() {
  return 1e-6 * static_cast<double>(thread_cpu_ns());
}

/// The median of at least one value; of an even number the upper of the middle two.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace brachy
