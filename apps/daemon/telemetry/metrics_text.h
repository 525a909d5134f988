#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "apps/daemon/loops/loop_statistics.h"
#include "apps/daemon/loops/ultrasound_loop.h"
#include "core/scene/scene.h"
#include "haptics/force/force_gate.h"
#include "net/server/server.h"
#include "net/wire/messages.h"

namespace brachy {

/// OpenIGTLink, since start.
struct IgtlFigures {
  std::size_t clients = 0;  ///< connected now
  std::uint64_t lost = 0;   ///< messages that were dropped, skipped, ignored or replaced by newer ones
};

/// The content of /metrics. No names or addresses of clients, no patient data.
struct DaemonMetrics {
  std::string simd;
  double start_time_s = 0;  ///< of the wall clock, since 1970
  const LoopStatistics& loop;
  const LoopStatistics& control;  ///< without ticks if there is no control thread
  const UltrasoundStatistics& ultrasound;
  std::uint64_t images_dropped = 0;
  const Scene& scene;       ///< in use
  net::StateMessage state;  ///< as Server::state
  net::Server::RoleCounts clients;
  IgtlFigures igtl;
  std::uint64_t connections_refused = 0, connections_shed = 0, wrong_tokens = 0, forces_replaced = 0;
  std::array<std::uint64_t, kInterventions> interventions{};
  std::uint32_t seeds = 0;  ///< in the tissue
  std::uint64_t reloads_done = 0, reloads_refused = 0;
  const Histogram& io_turns_ns;  ///< EventLoop::turns_ns
};

/// Prometheus' text format, version 0.0.4: base units (seconds, bytes), counters since the daemon's start.
std::string metrics_text(const DaemonMetrics& metrics);

}  // namespace brachy
