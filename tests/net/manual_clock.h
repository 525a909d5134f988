#pragma once

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "net/base/clock.h"

namespace brachy::net::test {

/// A clock that stands still until advance(). What is due then is posted to its io_context, in the order of its time.
/// Declare it before the io_context. Threads: any.
class ManualClock final : public TimerClock {
 public:
  static constexpr std::int64_t kBeginNs = 1'000'000'000'000;             ///< 0 would be "never"
  static constexpr std::int64_t kUtcBeginNs = 1'700'000'000'000'000'000;  ///< in 2023

  std::int64_t now_ns() override {
    const std::scoped_lock lock(mutex_);
    return now_ns_;
  }
  std::int64_t utc_ns() override { return kUtcBeginNs + now_ns() - kBeginNs; }
  /// The sleeper moves the time.
  void sleep_until_ns(std::int64_t deadline_ns) override {
    advance(std::chrono::nanoseconds(std::max<std::int64_t>(0, deadline_ns - now_ns())));
  }
  std::unique_ptr<Timer> make_timer(boost::asio::io_context& io) override {
    return std::make_unique<ManualTimer>(*this, io);
  }

  void advance(std::chrono::nanoseconds time) {
    const std::scoped_lock lock(mutex_);
    now_ns_ += time.count();
    std::vector<std::shared_ptr<Wait>> due;
    std::erase_if(waits_, [&](const std::weak_ptr<Wait>& weak) {
      const auto wait = weak.lock();
      if (wait && wait->deadline_ns > now_ns_) return false;
      if (wait) due.push_back(wait);
      return true;
    });
    std::ranges::stable_sort(due, {}, [](const auto& wait) { return wait->deadline_ns; });
    for (const auto& wait : due)
      boost::asio::post(wait->io, [weak = std::weak_ptr(wait)] {
        if (const auto expired = weak.lock()) expired->expire();
      });
  }

 private:
  /// One start() of a timer. The io_context owns it by its handler, which cancelling Asio's timer calls.
  struct Wait {
    Wait(boost::asio::io_context& its, std::int64_t deadline)
        : io(its), never(its, boost::asio::steady_timer::time_point::max()), deadline_ns(deadline) {}
    void expire() {
      if (state == State::kWaiting) end(State::kExpired);
    }
    enum class State { kWaiting, kExpired, kCancelled };
    void end(State how) {
      state = how;
      never.cancel();
    }
    boost::asio::io_context& io;
    boost::asio::steady_timer never;
    const std::int64_t deadline_ns;
    State state = State::kWaiting;
  };

  class ManualTimer final : public Timer {
   public:
    ManualTimer(ManualClock& clock, boost::asio::io_context& io) : clock_(clock), io_(io) {}
    ~ManualTimer() override { cancel(); }

    void start(std::chrono::nanoseconds after, std::function<void()> on_expiry) override {
      cancel();
      const auto wait = std::make_shared<Wait>(io_, clock_.now_ns() + after.count());
      wait->never.async_wait([wait, on_expiry = std::move(on_expiry)](const boost::system::error_code&) {
        if (wait->state == Wait::State::kExpired) on_expiry();
      });
      wait_ = wait;
      clock_.add(wait);
    }
    void cancel() override {
      if (const auto wait = wait_.lock()) wait->end(Wait::State::kCancelled);
    }

   private:
    ManualClock& clock_;
    boost::asio::io_context& io_;
    std::weak_ptr<Wait> wait_;
  };

  void add(const std::shared_ptr<Wait>& wait) {
    {
      const std::scoped_lock lock(mutex_);
      waits_.push_back(wait);
    }
    advance(std::chrono::nanoseconds(0));  // it may be due already
  }

  std::mutex mutex_;
  std::int64_t now_ns_ = kBeginNs;
  std::vector<std::weak_ptr<Wait>> waits_;
};

}  // namespace brachy::net::test
