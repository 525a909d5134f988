#include "apps/daemon/service/service_watch.h"

#include <utility>

#include "core/realtime/deadline.h"

namespace brachy {
namespace {

constexpr int kFeedsPerWatchdog = 4;

}  // namespace

ServiceWatch::ServiceWatch(EventLoop& loop, double period_s, Handlers handlers)
    : handlers_(std::move(handlers)), pulse_(period_s, monotonic_ns()), timer_(loop) {}

void ServiceWatch::begin() {
  pulse_.on_tick(monotonic_ns());  // the silence before the start does not count
  manager_.ready(handlers_.status());
  if (manager_.watchdog()) schedule_feed();
}

void ServiceWatch::end() {
  is_ending_ = true;
  timer_.cancel();
  manager_.stopping();
}

std::string ServiceWatch::failure() {
  handlers_.update();
  return pulse_.failure(monotonic_ns());
}

void ServiceWatch::reloading() {
  if (!is_ending_) manager_.reloading();
}

void ServiceWatch::reloaded(const std::string& outcome) {
  if (!is_ending_) manager_.ready(outcome);
}

void ServiceWatch::schedule_feed() {
  timer_.start_after(*manager_.watchdog() / kFeedsPerWatchdog, [this] {
    handlers_.update();
    if (pulse_.has_ticked()) manager_.alive(handlers_.status());
    schedule_feed();
  });
}

}  // namespace brachy
