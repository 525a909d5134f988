#include "apps/brachyd/service/service_manager.h"

#include <systemd/sd-daemon.h>

#include <cstdint>

#include "core/realtime/deadline.h"

namespace brachy {
namespace {

// A manager that is not there, or has gone, is no fault of the simulation's.
void tell(const std::string& state) {
  sd_notify(0, state.c_str());
}

}  // namespace

ServiceManager::ServiceManager() {
  std::uint64_t us = 0;
  if (sd_watchdog_enabled(0, &us) > 0) watchdog_ = std::chrono::microseconds(us);
}

void ServiceManager::ready(const std::string& status) {
  tell("READY=1\nSTATUS=" + status);
}

void ServiceManager::alive(const std::string& status) {
  tell("WATCHDOG=1\nSTATUS=" + status);
}

void ServiceManager::reloading() {
  // systemd 253 and later (Type=notify-reload) want to know when it began.
  tell("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(monotonic_ns() / 1000) +
       "\nSTATUS=reading the scene again");
}

void ServiceManager::stopping() {
  tell("STOPPING=1\nSTATUS=ending");
}

}  // namespace brachy
