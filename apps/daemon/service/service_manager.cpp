#include "apps/daemon/service/service_manager.h"

#include <systemd/sd-daemon.h>

#include <cstdint>

namespace brachy {
namespace {

// Errors are ignored: the simulation runs without a service manager too.
void notify(const std::string& state) {
  sd_notify(0, state.c_str());
}

}  // namespace

ServiceManager::ServiceManager() {
  std::uint64_t us = 0;
  if (sd_watchdog_enabled(0, &us) > 0) watchdog_ = std::chrono::microseconds(us);
}

void ServiceManager::ready(const std::string& status) {
  // After going_on() the watchdog is the usual one again.
  const std::string watchdog = watchdog_ ? "\nWATCHDOG_USEC=" + std::to_string(watchdog_->count()) : "";
  notify("READY=1" + watchdog + "\nSTATUS=" + status);
}

void ServiceManager::alive(const std::string& status) {
  notify("WATCHDOG=1\nSTATUS=" + status);
}

void ServiceManager::reloading(std::int64_t now_ns) {
  // systemd 253 and later (Type=notify-reload) want to know when it began.
  notify("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(now_ns / 1000) + "\nSTATUS=reading the scene again");
}

void ServiceManager::stopping() {
  notify("STOPPING=1\nSTATUS=ending");
}

void ServiceManager::going_on() {
  const std::string watchdog =
      watchdog_ ? "WATCHDOG_USEC=" + std::to_string(1'000'000L * kPauseS) + "\n" : "";
  notify(watchdog + "WATCHDOG=1\nSTATUS=beginning an exercise");
}

}  // namespace brachy
