#include "apps/daemon/service/service_watch.h"

#include <utility>

namespace brachy {
namespace {

constexpr int kFeedsPerWatchdog = 4;

}  // namespace

ServiceWatch::ServiceWatch(EventLoop& loop, double period_s, Handlers handlers)
    : handlers_(std::move(handlers)),
      clock_(loop.clock()),
      pulse_(period_s, clock_.now_ns()),
      timer_(loop.make_timer()) {}

void ServiceWatch::begin() {
  pulse_.on_tick(clock_.now_ns());  // the silence before the start does not count
  manager_.ready(handlers_.status());
  if (manager_.watchdog()) schedule_feed();
}

void ServiceWatch::end(End end) {
  is_ending_ = true;
  timer_->cancel();
  if (end == End::kStops)
    manager_.stopping();
  else
    manager_.going_on();
}

std::string ServiceWatch::failure() {
  handlers_.update();
  return pulse_.failure(clock_.now_ns());
}

void ServiceWatch::reloading() {
  if (!is_ending_) manager_.reloading(clock_.now_ns());
}

void ServiceWatch::reloaded(const std::string& outcome) {
  if (!is_ending_) manager_.ready(outcome);
}

void ServiceWatch::schedule_feed() {
  timer_->start(*manager_.watchdog() / kFeedsPerWatchdog, [this] {
    handlers_.update();
    if (pulse_.has_ticked()) manager_.alive(handlers_.status());
    schedule_feed();
  });
}

}  // namespace brachy
