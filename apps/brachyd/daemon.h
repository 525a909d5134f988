#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "apps/brachyd/dose_loop.h"
#include "apps/brachyd/loop_statistics.h"
#include "apps/options.h"
#include "core/scene/scene.h"
#include "haptics/force/force_gate.h"
#include "net/broker/publisher.h"

namespace brachy {

/// What a daemon did, for its last words.
struct DaemonSummary {
  double elapsed_s = 0;
  LoopStatistics loop, control;  ///< control is empty without the control thread
  std::uint64_t snapshots = 0;
  std::uint64_t poses_accepted = 0, poses_refused = 0;
  std::string realtime;                        ///< what the kernel granted
  std::string simd;                            ///< instruction set of the field evaluation
  std::array<std::uint64_t, 4> evaluations{};  ///< ticks evaluated in each way, indexed by Evaluation
  std::array<std::uint64_t, kInterventions> interventions{};  ///< for the hands' safety, by Intervention
  std::uint32_t seeds_dropped = 0, drops_refused = 0;         ///< in this run
  DoseStatistics dose;
  std::string session;             ///< the session's folder and what is in it; empty: none was asked for
  std::uint64_t wrong_tokens = 0;  ///< shown by clients
  std::optional<net::PublisherStatistics> broker;  ///< none: nothing was published
  std::uint64_t forces_replaced = 0;  ///< messages with forces that a newer one replaced before they left
  bool is_worker_busy = false;        ///< it still makes a simulator that nobody waits for; ~Daemon would
};

/// The running system: simulation, devices and server, and the only place that creates threads.
///
///   deformation thread  200 Hz   devices → Simulator::step → triple buffers: the mesh; the forces; the seeds
///   snapshot thread      30 Hz   triple buffer → copy → session log, server
///   dose thread         200 Hz   seeds that fell → dose → server
///   control thread      200 Hz   nothing, if asked for: what the machine itself misses
///   broker thread               messages → NATS server, where one is configured
///   workers             1        another simulator when an operator asks for one
///   io thread                    run()'s caller: sockets, signals, poses in, frames out; ≤ 1 kHz forces out; systemd
class Daemon {
 public:
  /// Loads what the scene names and binds the ports. Throws UserError.
  Daemon(const Scene& scene, const DaemonOptions& options);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  std::uint16_t port() const;
  const std::string& address() const;
  std::optional<std::uint16_t> http_port() const;  ///< nullopt: off
  std::optional<std::uint16_t> igtl_port() const;  ///< none: off
  const std::string& igtl_address() const;         ///< precondition: it is on

  /// Runs until SIGINT, SIGTERM, the options' duration, or stop(); SIGHUP reads the scene file again. Once only. From here on neither the calling thread nor
  /// any that it creates has a capability.
  DaemonSummary run();

  /// Ends run() within a second. Threads: any.
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy
