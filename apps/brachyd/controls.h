#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "apps/brachyd/simulation_runs.h"
#include "core/scene/scene.h"
#include "haptics/switched_device.h"
#include "net/server.h"

namespace brachy {

/// What an operator may ask of the running daemon (CONTROL in net/PROTOCOL.md): the scripted needle, the simulation anew,
/// another model. Threads: the io thread.
class Controls {
 public:
  using Log = std::function<void(const std::string&)>;
  using Done = std::function<void(const std::string& failure)>;  ///< "" once it is in use

  /// Everything outlives this. `is_recorded`: a session is, which must stay what its files say.
  Controls(const Scene& scene, std::span<const std::unique_ptr<SwitchedDevice>> devices, SimulationRuns& runs,
           net::Server& server, Log log, bool is_recorded)
      : model_(scene),
        devices_(devices),
        runs_(runs),
        server_(server),
        log_(std::move(log)),
        is_recorded_(is_recorded) {}

  /// "" where it is or will be done, else why not; `who` asks.
  std::string ask(const net::ControlMessage& message, const std::string& who);
  /// The scripted needles from their beginning; as ask().
  std::string play(bool loop);

  /// Goes on with a scene of the same tissue and needles. "" where it will be tried, of which `done` is told then; else why
  /// not. `what` is announced.
  std::string take_up(const Scene& scene, const std::string& what, Done done);

  const Scene& scene() const { return model_; }  ///< in use
  bool is_preparing() const { return runs_.is_preparing(); }
  net::ControlsState state() const;

  /// The newest snapshot's run.
  void seen(std::uint64_t run);

 private:
  bool has_script() const;  ///< for any needle
  std::string stop();
  std::string begin(const Scene& scene, bool goes_on, net::EventKind kind, const std::string& what,
                    Done done = nullptr);
  std::string change_model(const net::ControlMessage& message, const std::string& who);
  void announce(net::EventKind kind, const std::string& text);

  Scene model_;       // in use
  Scene next_model_;  // being prepared, as the next
  std::string next_what_;
  net::EventKind next_kind_ = net::EventKind::kNote;
  Done next_done_;                                            // empty: nobody waits
  std::span<const std::unique_ptr<SwitchedDevice>> devices_;  // by needle
  SimulationRuns& runs_;
  net::Server& server_;
  const Log log_;
  bool is_recorded_;
  bool plays_ = false, loops_ = false;
};

}  // namespace brachy
