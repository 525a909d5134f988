#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/realtime/histogram.h"
#include "core/realtime/realtime_thread.h"
#include "core/scene/scene.h"

namespace brachy {

/// What this machine grants a daemon, and how punctually it wakes it.
struct Machine {
  unsigned cores = 0;  ///< that this process may use
  std::string cpu;     ///< model name; empty: the system does not say
  std::string simd;    ///< in use for the scene
  std::vector<std::string> simd_targets;
  std::string governor;  ///< of the first core; empty: none is to be seen, as in most virtual machines
  std::optional<double> stolen_share;  ///< of all cores' time, by the host, while lateness was measured
  int fifo_priority = 0;               ///< that was asked for
  std::string fifo_refusal;            ///< empty: SCHED_FIFO is granted
  std::string memory_refusal;          ///< empty: locking memory is
  bool is_measured_with_fifo = false;  ///< lateness is of such a thread, as the scene asks
  double seconds = 0, period_s = 0;    ///< of the measurement, and between its deadlines
  Histogram lateness_ns;               ///< wake-up after the deadline, with nothing else to do
};

/// Takes `seconds`. Throws UserError: the scene's engine.simd is not to be had here. Threads: the one that calls becomes what the
/// scene asks for its deformation thread, and an ordinary one again.
Machine look_at_machine(const Scene& scene, double seconds);

}  // namespace brachy
