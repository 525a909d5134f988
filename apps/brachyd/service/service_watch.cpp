#include "apps/brachyd/service/service_watch.h"

#include <utility>

#include "core/realtime/deadline.h"

namespace brachy {
namespace {

constexpr int kFeedsPerWatchdog = 4;

}  // namespace

ServiceWatch::ServiceWatch(boost::asio::io_context& io, double period_s, Handlers handlers)
    : handlers_(std::move(handlers)), pulse_(period_s, monotonic_ns()), timer_(io) {}

void ServiceWatch::begin() {
  pulse_.see(monotonic_ns());  // up to here nothing was to tick
  manager_.ready(handlers_.status());
  if (manager_.watchdog()) feed_later();
}

void ServiceWatch::end() {
  is_ending_ = true;
  timer_.cancel();
  manager_.stopping();
}

std::string ServiceWatch::failure() {
  handlers_.look();
  return pulse_.failure(monotonic_ns());
}

void ServiceWatch::reloading() {
  if (!is_ending_) manager_.reloading();
}

void ServiceWatch::reloaded(const std::string& outcome) {
  if (!is_ending_) manager_.ready(outcome);
}

void ServiceWatch::feed_later() {
  timer_.expires_after(*manager_.watchdog() / kFeedsPerWatchdog);
  timer_.async_wait([this](const auto& error) {
    if (error || is_ending_) return;
    handlers_.look();
    if (pulse_.has_ticked()) manager_.alive(handlers_.status());
    feed_later();
  });
}

}  // namespace brachy
