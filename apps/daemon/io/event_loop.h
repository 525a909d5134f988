#pragma once

#include <functional>
#include <initializer_list>
#include <memory>

#include "core/realtime/histogram.h"
#include "net/base/clock.h"

namespace brachy {

// Asio behind plain classes: only event_loop.cpp and net compile its headers.

/// The event loop of the io thread: sockets, timers and signals.
/// Threads: run() makes its caller the io thread; post() any; the rest before run() or on the io thread.
class EventLoop {
 public:
  /// `clock` outlives the loop.
  explicit EventLoop(net::TimerClock& clock);
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Runs handlers until nothing is left to wait for.
  void run();
  /// After run(): the handlers that are ready now. Threads: the one of run().
  void run_ready();
  /// Runs `work` on the io thread. Threads: any. Real-time: no, it allocates and locks.
  void post(std::function<void()> work);

  /// Of the handlers that run() has called: processor time of each, ns. None should take more than 1 ms: everything
  /// else that the thread serves waits meanwhile. Threads: the io thread, or after run().
  const Histogram& turns_ns() const { return turns_ns_; }

  boost::asio::io_context& io() { return *io_; }  ///< for the servers of net
  /// The daemon's time. Threads: any.
  net::TimerClock& clock() const { return clock_; }
  /// The loop outlives it.
  std::unique_ptr<net::Timer> make_timer() { return clock_.make_timer(*io_); }

 private:
  net::TimerClock& clock_;
  std::unique_ptr<boost::asio::io_context> io_;
  Histogram turns_ns_;
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
