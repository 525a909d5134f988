#include "apps/daemon/forces/force_cycle.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace brachy {

ForceCycle::ForceCycle(EventLoop& loop, HandOver<TickForces>::Reader& ticks, std::size_t needles,
                       ForceLinkOutputs outputs, OnTick on_tick)
    : clock_(loop.clock()),
      ticks_(ticks),
      link_(needles, std::move(outputs)),
      on_tick_(std::move(on_tick)),
      timer_(loop.make_timer()) {}

void ForceCycle::on_device(bool attached, const net::DeviceInfo& device) {
  attached ? link_.attach(device) : link_.detach(device);
  if (is_running_ || is_stopped_) return;
  is_running_ = true;  // against a second cycle from within the first
  due_ns_ = clock_.now_ns();
  run_cycle();
}

void ForceCycle::run_cycle() {
  update();
  link_.cycle(clock_.now_ns());
  is_running_ = link_.is_active();
  if (!is_running_) return;
  // Missed cycles are skipped.
  const std::int64_t now_ns = clock_.now_ns();
  due_ns_ = std::max(due_ns_ + link_.period_ns(), now_ns);
  timer_->start(std::chrono::nanoseconds(due_ns_ - now_ns), [this] { run_cycle(); });
}

void ForceCycle::update() {
  if (!ticks_.update()) return;
  on_tick_(ticks_.value());
  link_.on_tick(ticks_.value(), clock_.now_ns());
}

void ForceCycle::stop() {
  is_stopped_ = true;
  timer_->cancel();
}

}  // namespace brachy
