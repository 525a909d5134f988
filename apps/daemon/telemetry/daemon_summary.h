#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "apps/daemon/exercise/attempts.h"
#include "apps/daemon/loops/dose_loop.h"
#include "apps/daemon/loops/loop_statistics.h"
#include "apps/daemon/loops/ultrasound_loop.h"
#include "haptics/force/force_gate.h"
#include "net/broker/publisher.h"

namespace brachy {

/// What a daemon did from start to end, for its closing report.
struct DaemonSummary {
  double elapsed_s = 0;
  LoopStatistics loop, control;  ///< control is empty without the control thread
  std::uint64_t snapshots = 0;
  std::uint64_t poses_accepted = 0, poses_refused = 0;
  std::string realtime;                        ///< what the kernel granted
  std::string simd;                            ///< instruction set of the field evaluation
  std::array<std::uint64_t, 4> evaluations{};  ///< ticks evaluated in each way, indexed by Evaluation
  std::array<std::uint64_t, kInterventions> interventions{};  ///< of the force gates, by Intervention
  std::uint32_t seeds_dropped = 0, drops_refused = 0;         ///< in this run
  DoseStatistics dose;
  UltrasoundStatistics ultrasound;  ///< empty where no client asked for images
  std::string session;              ///< the session's directory and its contents; empty: none was recorded
  std::uint64_t wrong_tokens = 0;   ///< presented by clients
  std::optional<net::PublisherStatistics> broker;  ///< nullopt: nothing was published
  std::uint64_t forces_replaced = 0;  ///< force messages that a newer one replaced before they were sent
  std::optional<Attempt> next;        ///< what to go on with, on the same ports; none: the daemon was ended
  bool is_worker_busy = false;  ///< a worker still builds a simulator nobody needs; ~Daemon would wait for it
};

}  // namespace brachy
