#include "apps/daemon/loops/snapshot_loop.h"

#include <cmath>

namespace brachy {

std::uint64_t run_snapshot_loop(const std::stop_token& stop, Clock& clock, double snapshot_hz,
                                HandOver<MeshState>::Reader& states,
                                const std::function<void(std::shared_ptr<const MeshState>)>& deliver) {
  const std::int64_t period_ns = std::llround(1e9 / snapshot_hz);
  DeadlineTimer timer(period_ns, clock.now_ns() + period_ns, clock);
  std::uint64_t delivered = 0;
  while (!stop.stop_requested()) {
    timer.wait();
    if (!states.update()) continue;
    deliver(std::make_shared<const MeshState>(states.value()));
    ++delivered;
  }
  return delivered;
}

}  // namespace brachy
