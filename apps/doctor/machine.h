#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/realtime/histogram.h"
#include "core/realtime/realtime_thread.h"
#include "core/scene/scene.h"

namespace brachy {

/// What this machine grants a daemon, and how late it wakes its threads.
struct Machine {
  unsigned cores = 0;  ///< that this process may use
  std::string cpu;     ///< model name; empty: the system does not say
  std::string simd;    ///< in use for the scene
  std::vector<std::string> simd_targets;
  std::string governor;                ///< of the first core; empty: not visible, as in most virtual machines
  std::optional<double> stolen_share;  ///< of all cores' time, by the host, while lateness was measured
  int fifo_priority = 0;               ///< requested
  std::string fifo_refusal;            ///< empty: SCHED_FIFO is granted
  std::string memory_refusal;          ///< empty: locking memory is
  bool is_measured_with_fifo = false;  ///< lateness was measured with SCHED_FIFO, as the scene requests
  double seconds = 0, period_s = 0;    ///< of the measurement, and between its deadlines
  Histogram lateness_ns;               ///< wake-up after the deadline, with nothing else to do
  double work_scale = 1;               ///< of measure_work_scale, which measure_machine does not call
};

/// Takes `seconds`. Throws UserError if the scene's engine.simd is not available here. Threads: the calling
/// thread gets the scheduling that the scene requests for its deformation thread, and then normal scheduling
/// again.
Machine measure_machine(const Scene& scene, double seconds);

}  // namespace brachy
