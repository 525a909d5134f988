#pragma once

#include <utility>
#include <vector>

#include "apps/reports/timing.h"

namespace brachy {

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
