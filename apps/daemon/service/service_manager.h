#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace brachy {

/// Notifies systemd, or another service manager that set NOTIFY_SOCKET (sd_notify(3)). Without one every call
/// does nothing. A status is one line. Threads: one.
class ServiceManager {
 public:
  ServiceManager();  ///< reads WATCHDOG_USEC

  /// The manager kills the daemon if alive() is not called this often. nullopt: no watchdog.
  std::optional<std::chrono::microseconds> watchdog() const { return watchdog_; }

  void ready(const std::string& status);  ///< listening; or a reload is over
  void alive(const std::string& status);  ///< feeds the watchdog
  void reloading(std::int64_t now_ns);    ///< on CLOCK_MONOTONIC
  void stopping();
  void going_on();  ///< nothing ticks for a while, at most kPauseS, until ready()
  static constexpr int kPauseS = 60;

 private:
  std::optional<std::chrono::microseconds> watchdog_;
};

}  // namespace brachy
