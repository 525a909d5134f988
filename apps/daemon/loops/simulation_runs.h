#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "apps/daemon/io/event_loop.h"
#include "apps/daemon/loops/simulation_run.h"
#include "core/realtime/hand_over.h"

namespace brachy {

struct Scene;

/// The simulation in use and its successor: built on `worker`, handed to the deformation thread through a
/// triple buffer; the old one is freed once a snapshot shows the new one.
/// Threads: the io thread unless stated. `worker` is ended before this is destroyed.
class SimulationRuns {
 public:
  SimulationRuns(std::shared_ptr<SimulationRun> first, EventLoop& loop, Worker& worker)
      : loop_(loop), worker_(worker), in_use_(std::move(first)) {}

  /// Threads: also others, before the threads start and after they have ended.
  SimulationRun& in_use() { return *in_use_; }
  HandOver<SimulationRun*>::Reader& reader() { return next_for_loop_.reader; }  ///< deformation thread

  /// Called with the number and the model of a successor before it is handed over; none: not called.
  std::function<void(std::uint64_t run, const std::shared_ptr<const SimulationModel>&)> on_model;

  /// A successor is being built: `worker` is busy until it is done.
  bool is_building() const { return is_preparing_ && !next_; }
  /// A successor was requested and is not in use yet.
  bool is_preparing() const { return is_preparing_; }

  /// Builds a simulator of `scene`, which has the first one's tissue; it continues with the time and the seeds of the
  /// run before. `on_failure` is called with the reason if that fails; the old one then continues.
  /// Precondition: not is_preparing().
  void begin(const Scene& scene, std::function<void(const std::string&)> on_failure);
  /// The simulation in use from its start, with the same model. Otherwise as begin.
  void restart(std::function<void(const std::string&)> on_failure);

  /// A snapshot of this run was taken. Returns whether it is the first of a new run.
  bool on_snapshot(std::uint64_t run);

 private:
  using MakeModel = std::function<std::shared_ptr<const SimulationModel>()>;
  void build(MakeModel make_model, bool resumes, std::function<void(const std::string&)> on_failure);

  EventLoop& loop_;
  Worker& worker_;
  std::shared_ptr<SimulationRun> in_use_, next_;
  bool is_preparing_ = false;
  HandOver<SimulationRun*> next_for_loop_;
};

}  // namespace brachy
