#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "apps/daemon/loops/loop_statistics.h"

namespace brachy {

/// Statistics since the last report instead of since the start: for a log, or a chart over hours.
/// Threads: one.
class IntervalReport {
 public:
  struct Interval {
    double elapsed_s = 0;  ///< since start, at its end
    std::uint64_t ticks = 0, overruns = 0;
    Histogram tick_ns, lateness_ns;
    std::size_t clients = 0;  ///< at its end
  };

  /// `total` holds what was counted since start.
  Interval next(double elapsed_s, const LoopStatistics& total, std::size_t clients);

 private:
  LoopStatistics last_;
};

std::string to_text(const IntervalReport::Interval& interval);
std::string to_json(const IntervalReport::Interval& interval);  ///< one line

}  // namespace brachy
