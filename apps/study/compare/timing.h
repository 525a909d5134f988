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

/// How long to time a model's ticks.
struct Effort {
  double tick_budget_ms = 150;
  int least_ticks = 7, most_ticks = 300;
};

/// Median time of calls of `tick`, which returns its ms.
template <class Tick>
double median_ms(const Effort& effort, Tick tick) {
  std::vector<double> times;
  for (double spent = 0;
       static_cast<int>(times.size()) < effort.least_ticks ||
       (spent < effort.tick_budget_ms && static_cast<int>(times.size()) < effort.most_ticks);
       spent += times.back())
    times.push_back(tick());
  return median(std::move(times));
}

}  // namespace brachy
