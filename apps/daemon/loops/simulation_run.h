#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/simulation/simulator.h"

namespace brachy {

/// A simulator with the slots that it will write, for the deformation thread: a restart from rest, or the
/// same simulation with another model. Built on another thread, which may take seconds.
struct SimulationRun {
  SimulationRun(std::uint64_t run, bool keeps_time, std::shared_ptr<const SimulationModel> model)
      : number(run), resumes(keeps_time), simulator(std::move(model)) {
    slots_.fill(simulator.initial_state());
    for (MeshState& slot : slots_) slot.summary.run = number;
  }

  const std::uint64_t number;  ///< TickSummary::run
  const bool resumes;          ///< with the time and the seeds of the run before
  Simulator simulator;

  /// Swaps one of this run's slots with `slot` of a triple buffer, which an earlier run wrote; at most once
  /// for each of the three. Real-time: no allocation; the old content is freed together with this run.
  void swap_slot(MeshState& slot) noexcept { std::swap(slot, slots_[swapped_++]); }

 private:
  std::array<MeshState, 3> slots_;
  std::size_t swapped_ = 0;
};

}  // namespace brachy
