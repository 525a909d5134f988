#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "apps/daemon/loops/simulation_runs.h"
#include "core/scene/scene.h"
#include "net/requests/request.h"

namespace brachy::net {
class Server;
}

namespace brachy {

class SwitchedDevice;

/// Commands of an operator to the running daemon (CONTROL in net/PROTOCOL.md): play or stop the scripted
/// needles, reset the simulation, change the model. Threads: the io thread.
class Controls {
 public:
  using Log = std::function<void(const std::string&)>;
  using Done = std::function<void(const std::string& failure)>;  ///< "" once it is in use

  /// All arguments outlive this. `is_recorded`: a session is being recorded, and nothing may change that its
  /// files state.
  Controls(const Scene& scene, std::span<const std::unique_ptr<SwitchedDevice>> devices, SimulationRuns& runs,
           net::Server& server, Log log, bool is_recorded)
      : model_(scene),
        devices_(devices),
        runs_(runs),
        server_(server),
        log_(std::move(log)),
        is_recorded_(is_recorded) {}

  /// Carries out a command. Returns "" if it is done, or will be done or refused (net::Sender::refuse), else the reason
  /// why not.
  std::string execute(const net::ControlMessage& message, const net::Sender& from);
  /// Plays the scripted needles from their beginning; returns as execute().
  std::string play(bool loop);

  /// Continues with a scene of the same tissue and needles; `what` is announced to the clients. Returns "" if
  /// that is tried, and calls `done` with the outcome; else the reason why not.
  std::string change_scene(const Scene& scene, const std::string& what, Done done);

  const Scene& scene() const { return model_; }  ///< in use
  bool is_preparing() const { return runs_.is_preparing(); }
  net::ControlsState state() const;

  /// A snapshot of this run was taken.
  void on_snapshot(std::uint64_t run);

 private:
  bool has_script() const;  ///< for any needle
  std::string stop();
  std::string begin(const Scene& scene, bool resumes, net::EventKind kind, const std::string& what,
                    Done done = nullptr);
  std::string change_model(const net::ControlMessage& message, const net::Sender& from);
  void announce(net::EventKind kind, const std::string& text);

  Scene model_;       // in use
  Scene next_model_;  // being prepared, as the three below
  std::string next_what_;
  net::EventKind next_kind_ = net::EventKind::kNote;
  Done next_done_;                                            // may be empty
  std::span<const std::unique_ptr<SwitchedDevice>> devices_;  // by needle
  SimulationRuns& runs_;
  net::Server& server_;
  const Log log_;
  bool is_recorded_;
  bool plays_ = false, loops_ = false;
};

}  // namespace brachy
