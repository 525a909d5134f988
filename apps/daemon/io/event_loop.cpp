#include "apps/daemon/io/event_loop.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <utility>

namespace brachy {

EventLoop::EventLoop() : io_(std::make_unique<boost::asio::io_context>(1)) {}
EventLoop::~EventLoop() = default;

void EventLoop::run() {
  io_->run();
}

void EventLoop::post(std::function<void()> work) {
  boost::asio::post(*io_, std::move(work));
}

class Timer::Impl {
 public:
  explicit Impl(boost::asio::io_context& io) : timer(io) {}
  boost::asio::steady_timer timer;
  std::shared_ptr<std::function<void()>> call;  // what is waited for; null: nothing
};

Timer::Timer(EventLoop& loop) : impl_(std::make_unique<Impl>(loop.io())) {}
Timer::~Timer() = default;

void Timer::start_at(Clock::time_point due, std::function<void()> on_due) {
  impl_->timer.expires_at(due);
  impl_->call = std::make_shared<std::function<void()>>(std::move(on_due));
  // Asio does not take back a handler that is due already: it finds its call gone.
  impl_->timer.async_wait([call = std::weak_ptr(impl_->call)](const auto& error) {
    const auto waiting = call.lock();
    if (!error && waiting) (*waiting)();
  });
}

void Timer::start_after(std::chrono::nanoseconds delay, std::function<void()> on_due) {
  start_at(Clock::now() + delay, std::move(on_due));
}

void Timer::cancel() {
  impl_->call.reset();
  impl_->timer.cancel();
}

class SignalWait::Impl {
 public:
  explicit Impl(boost::asio::io_context& io) : signals(io) {}
  boost::asio::signal_set signals;
};

SignalWait::SignalWait(EventLoop& loop, std::initializer_list<int> numbers)
    : impl_(std::make_unique<Impl>(loop.io())) {
  for (const int number : numbers) impl_->signals.add(number);
}
SignalWait::~SignalWait() = default;

void SignalWait::start(std::function<void(int)> on_signal) {
  impl_->signals.async_wait([call = std::move(on_signal)](const auto& error, int number) {
    if (!error) call(number);
  });
}

void SignalWait::cancel() {
  impl_->signals.cancel();
}

class Worker::Impl {
 public:
  boost::asio::thread_pool thread{1};
};

Worker::Worker() : impl_(std::make_unique<Impl>()) {}
Worker::~Worker() {
  end();
}

void Worker::post(std::function<void()> work) {
  boost::asio::post(impl_->thread, std::move(work));
}

void Worker::stop() {
  impl_->thread.stop();
}

void Worker::end() {
  impl_->thread.stop();
  impl_->thread.join();
}

}  // namespace brachy
