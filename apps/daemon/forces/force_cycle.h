#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "apps/daemon/forces/force_link.h"
#include "apps/daemon/forces/tick_forces.h"
#include "apps/daemon/io/event_loop.h"
#include "core/realtime/hand_over.h"

namespace brachy {

/// Runs a ForceLink on the io thread: passes each published tick to it and, while a device with forces is
/// attached or a force still decays to 0, calls its cycle at the rate of the fastest device, at most 1 kHz.
/// Threads: the io thread.
class ForceCycle {
 public:
  using OnTick = std::function<void(const TickForces&)>;  ///< a new tick was seen

  /// `loop` and `ticks` outlive this, which is the only user of `ticks`.
  ForceCycle(EventLoop& loop, HandOver<TickForces>::Reader& ticks, std::size_t needles,
             ForceLinkOutputs outputs, OnTick on_tick);

  ForceLink& link() { return link_; }
  const ForceLink& link() const { return link_; }

  /// A device that takes forces came or left.
  void on_device(bool attached, const net::DeviceInfo& device);
  /// Takes the newest tick, if it is new.
  void update();
  /// Sends no more forces.
  void stop();

 private:
  void run_cycle();

  net::TimerClock& clock_;
  HandOver<TickForces>::Reader& ticks_;
  ForceLink link_;
  const OnTick on_tick_;
  const std::unique_ptr<net::Timer> timer_;
  std::int64_t due_ns_ = 0;  // of the next cycle
  bool is_running_ = false, is_stopped_ = false;
};

}  // namespace brachy
