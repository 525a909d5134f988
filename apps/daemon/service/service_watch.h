#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "apps/daemon/io/event_loop.h"
#include "apps/daemon/service/loop_pulse.h"
#include "apps/daemon/service/service_manager.h"

namespace brachy {

/// Readiness and watchdog: reports the daemon's state to the service manager, and feeds its watchdog as long
/// as this thread runs and the deformation loop ticks. Threads: the io thread.
class ServiceWatch {
 public:
  struct Handlers {
    std::function<void()> update;         ///< calls on_tick() if there is a new tick
    std::function<std::string()> status;  ///< one line
  };

  /// `loop` outlives this.
  ServiceWatch(EventLoop& loop, double period_s, Handlers handlers);

  void begin();  ///< the daemon listens, and its loop ticks from here on
  /// Reports that the daemon is stopping, unless another goes on in this process; and nothing afterwards.
  enum class End { kStops, kGoesOn };
  void end(End end = End::kStops);

  /// A tick that began at `start_ns` was published.
  void on_tick(std::int64_t start_ns) { pulse_.on_tick(start_ns); }
  /// "" or a description of what is wrong.
  std::string failure();

  void reloading();
  void reloaded(const std::string& outcome);

 private:
  void schedule_feed();

  const Handlers handlers_;
  ServiceManager manager_;
  net::TimerClock& clock_;
  LoopPulse pulse_;
  const std::unique_ptr<net::Timer> timer_;
  bool is_ending_ = false;
};

}  // namespace brachy
