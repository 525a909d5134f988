#pragma once

#include <cstdint>

#include "apps/reports/certificate_tally.h"
#include "core/realtime/histogram.h"

namespace brachy {

/// What the deformation loop measures of itself since start; durations in ns.
struct LoopStatistics {
  Histogram tick_ns;      ///< from wake-up to publish
  Histogram lateness_ns;  ///< wake-up after the deadline
  Histogram latency_ns;   ///< a fresh pose received to its mesh published
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;         ///< deadlines missed: skipped, never caught up
  std::uint64_t longest_overrun = 0;  ///< most missed in a row
  CertificateTally certificates;      ///< of every tick
  double max_displacement_mm = 0;
  std::uint32_t moved_vertices = 0;  ///< most in one tick
  double max_tip_deflection_mm = 0;  ///< of any needle

  /// Takes the deadlines missed since start, after each wait for the next.
  void count_overruns(std::uint64_t missed) noexcept {
    longest_overrun = std::max(longest_overrun, missed - overruns);
    overruns = missed;
  }
};

}  // namespace brachy
