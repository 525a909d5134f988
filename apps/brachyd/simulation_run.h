#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "core/sim/simulator.h"

namespace brachy {

/// A simulator with the slots that it will write: what the deformation thread is handed when the simulation is to begin
/// anew or to go on with another model. Made on another thread, which may take seconds.
struct SimulationRun {
  SimulationRun(std::uint64_t run, bool keeps_time, const Scene& scene, Tissue tissue)
      : number(run), goes_on(keeps_time), simulator(scene, std::move(tissue)) {
    slots_.fill(simulator.initial_state());
    for (MeshState& slot : slots_) slot.run = number;
  }

  const std::uint64_t number;  ///< MeshState::run
  const bool goes_on;          ///< with the time and the seeds of the run before
  Simulator simulator;

  /// Swaps one of this run's slots into a triple buffer's slot of an earlier one, each of which comes here once.
  /// Real-time: no allocation; what it was is freed with this.
  void fit(MeshState& slot) noexcept { std::swap(slot, slots_[fitted_++]); }

 private:
  std::array<MeshState, 3> slots_;
  std::size_t fitted_ = 0;
};

}  // namespace brachy
