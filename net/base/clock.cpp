#include "net/base/clock.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>

namespace brachy::net {
namespace {

class AsioTimer final : public Timer {
 public:
  explicit AsioTimer(boost::asio::io_context& io) : timer_(io) {}
  ~AsioTimer() override { ++*turn_; }

  void start(std::chrono::nanoseconds after, std::function<void()> on_expiry) override {
    timer_.expires_after(after);
    // An expiry that is already queued is not cancelled by Asio: its turn has passed.
    timer_.async_wait([on_expiry = std::move(on_expiry), latest = turn_,
                       turn = ++*turn_](const boost::system::error_code& error) {
      if (!error && turn == *latest) on_expiry();
    });
  }

  void cancel() override {
    ++*turn_;
    timer_.cancel();
  }

 private:
  boost::asio::steady_timer timer_;
  const std::shared_ptr<std::uint64_t> turn_ = std::make_shared<std::uint64_t>(0);  // shared with the waits
};

class RealClock final : public TimerClock {
 public:
  std::int64_t now_ns() override { return monotonic_ns(); }
  void sleep_until_ns(std::int64_t deadline_ns) override { monotonic_clock().sleep_until_ns(deadline_ns); }
  std::int64_t utc_ns() override {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  }
  std::unique_ptr<Timer> make_timer(boost::asio::io_context& io) override {
    return std::make_unique<AsioTimer>(io);
  }
};

}  // namespace

TimerClock& real_clock() {
  static RealClock clock;
  return clock;
}

}  // namespace brachy::net
