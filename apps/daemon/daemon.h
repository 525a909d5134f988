#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "apps/command_line/options.h"
#include "apps/daemon/telemetry/daemon_summary.h"
#include "core/scene/scene.h"
#include "net/base/clock.h"

namespace brachy {

/// The running system: simulation, devices and server, and the only place that creates threads.
///
///   deformation thread  200 Hz   devices → Simulator::step → triple buffers: the mesh; the forces; the seeds
///   snapshot thread      30 Hz   triple buffer → copy → session log, server
///   dose thread         200 Hz   dropped seeds → dose → server
///   ultrasound thread    30 Hz   triple buffer → its own field → images → triple buffers, while clients ask for them
///   control thread      200 Hz   nothing, if enabled: its missed deadlines are the machine's
///   broker thread               messages → NATS server, where one is configured
///   worker              1        builds another simulator when an operator requests one; reads the scene again
///   plan thread         on request, optimises what is left of the plan
///   score thread        on request, of an exercise's session so far
///   io thread                    run()'s caller: sockets, signals, systemd; poses in,
///                                snapshots and forces (≤ 1 kHz) out
class Daemon {
 public:
  /// Loads what the scene names and binds the ports. Throws UserError. `clock`, which all its threads take their time
  /// from, outlives it.
  Daemon(const Scene& scene, const DaemonOptions& options, net::TimerClock& clock = net::real_clock());
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  std::uint16_t port() const;
  const std::string& address() const;
  std::optional<std::uint16_t> http_port() const;  ///< nullopt: off
  std::optional<std::uint16_t> igtl_port() const;  ///< none: off
  const std::string& igtl_address() const;         ///< precondition: it is on

  /// Runs until SIGINT, SIGTERM, the options' duration, or stop(); SIGHUP reads the scene file again. Once
  /// only. From here on neither the calling thread nor any that it creates has a capability.
  DaemonSummary run();

  /// Ends run() within a second. Threads: any.
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy
