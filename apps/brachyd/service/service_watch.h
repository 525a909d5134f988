#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <string>

#include "apps/brachyd/service/loop_pulse.h"
#include "apps/brachyd/service/service_manager.h"

namespace brachy {

/// Tells the service manager how the daemon is, and feeds its watchdog: as long as this thread runs and the deformation loop
/// ticks. Threads: the io thread.
class ServiceWatch {
 public:
  struct Handlers {
    std::function<void()> look;           ///< tells see() of the newest tick
    std::function<std::string()> status;  ///< one line
  };

  ServiceWatch(boost::asio::io_context& io, double period_s, Handlers handlers);

  void begin();  ///< the daemon listens, and its loop ticks from here on
  void end();    ///< it is ending: nothing but that is told any more

  /// A tick that began then was published.
  void see(std::int64_t start_ns) { pulse_.see(start_ns); }
  /// "" or what is wrong.
  std::string failure();

  void reloading();
  void reloaded(const std::string& outcome);

 private:
  void feed_later();

  const Handlers handlers_;
  ServiceManager manager_;
  LoopPulse pulse_;
  boost::asio::steady_timer timer_;
  bool is_ending_ = false;
};

}  // namespace brachy
