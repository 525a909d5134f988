#pragma once

#include <chrono>
#include <functional>
#include <initializer_list>
#include <memory>

namespace boost::asio {
class io_context;
}

namespace brachy {

// Asio behind plain classes: only event_loop.cpp and net compile its headers.

/// The event loop of the io thread: sockets, timers and signals.
/// Threads: run() makes its caller the io thread; post() any; the rest before run() or on the io thread.
class EventLoop {
 public:
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Runs handlers until nothing is left to wait for.
  void run();
  /// Runs `work` on the io thread. Threads: any. Real-time: no, it allocates and locks.
  void post(std::function<void()> work);

  boost::asio::io_context& io() { return *io_; }  ///< for the servers of net

 private:
  std::unique_ptr<boost::asio::io_context> io_;
};

/// Calls a function once, at a time. The loop outlives it. Threads: the io thread.
class Timer {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Timer(EventLoop& loop);
  ~Timer();
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  /// Replaces what was waited for. A time that has passed is due at once.
  void start_at(Clock::time_point due, std::function<void()> on_due);
  void start_after(std::chrono::nanoseconds delay, std::function<void()> on_due);
  /// The call does not come any more, even if it is due already; nor after the timer's end.
  void cancel();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Waits for signals. Those that arrive after construction are kept until start(). Threads: the io thread.
class SignalWait {
 public:
  SignalWait(EventLoop& loop, std::initializer_list<int> numbers);
  ~SignalWait();
  SignalWait(const SignalWait&) = delete;
  SignalWait& operator=(const SignalWait&) = delete;

  /// Calls once, at the next of these signals.
  void start(std::function<void(int number)> on_signal);
  void cancel();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// A background thread for work that takes seconds. Threads: any.
class Worker {
 public:
  Worker();
  ~Worker();  ///< as end()
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void post(std::function<void()> work);
  void stop();  ///< starts nothing more; what runs is not interrupted
  void end();   ///< stops, and waits for what runs

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy
