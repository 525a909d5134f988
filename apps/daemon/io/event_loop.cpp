#include "apps/daemon/io/event_loop.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/thread_pool.hpp>
#include <utility>

#include "core/realtime/deadline.h"

namespace brachy {
EventLoop::EventLoop(net::TimerClock& clock)
    : clock_(clock), io_(std::make_unique<boost::asio::io_context>(1)) {}
EventLoop::~EventLoop() = default;

void EventLoop::run() {
  std::int64_t before_ns = thread_cpu_ns();
  while (io_->run_one() > 0) {
    const std::int64_t now_ns = thread_cpu_ns();
    turns_ns_.record(now_ns - before_ns);
    before_ns = now_ns;
  }
}

void EventLoop::run_ready() {
  io_->restart();
  io_->poll();
}

void EventLoop::post(std::function<void()> work) {
  boost::asio::post(*io_, std::move(work));
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
