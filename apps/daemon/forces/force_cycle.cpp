#include "apps/daemon/forces/force_cycle.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/realtime/deadline.h"

namespace brachy {

ForceCycle::ForceCycle(EventLoop& loop, HandOver<TickForces>::Reader& ticks, std::size_t needles,
                       ForceLinkOutputs outputs, OnTick on_tick)
    : ticks_(ticks), link_(needles, std::move(outputs)), on_tick_(std::move(on_tick)), timer_(loop) {}

void ForceCycle::on_device(bool attached, const net::DeviceInfo& device) {
  attached ? link_.attach(device) : link_.detach(device);
  if (is_running_ || is_stopped_) return;
  is_running_ = true;  // against a second cycle from within the first
  due_ = Timer::Clock::now();
  run_cycle();
}

void ForceCycle::run_cycle() {
  const std::int64_t now_ns = monotonic_ns();
  update(now_ns);
  link_.cycle(now_ns);
  is_running_ = link_.is_active();
  if (!is_running_) return;
  // Missed cycles are skipped.
  due_ = std::max(due_ + std::chrono::nanoseconds(link_.period_ns()), Timer::Clock::now());
  timer_.start_at(due_, [this] { run_cycle(); });
}

void ForceCycle::update(std::int64_t now_ns) {
  if (!ticks_.update()) return;
  on_tick_(ticks_.value());
  link_.on_tick(ticks_.value(), now_ns);
}

void ForceCycle::stop() {
  is_stopped_ = true;
  timer_.cancel();
}

}  // namespace brachy
