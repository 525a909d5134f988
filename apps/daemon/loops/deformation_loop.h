#pragma once

#include <array>
#include <span>
#include <stop_token>

#include "apps/daemon/forces/tick_forces.h"
#include "apps/daemon/loops/dropped_seeds.h"
#include "apps/daemon/loops/imaged_tick.h"
#include "apps/daemon/loops/loop_statistics.h"
#include "apps/daemon/loops/saved_tick.h"
#include "apps/daemon/loops/simulation_run.h"
#include "core/realtime/deadline.h"
#include "core/realtime/hand_over.h"
#include "haptics/devices/device.h"

namespace brachy {

/// Inputs and outputs of the deformation loop, for its thread only. All outlive the loop.
struct DeformationPorts {
  HandOver<SimulationRun*>::Reader& runs;  ///< successors of the first run, of the same scene
  std::span<Device* const> devices;       ///< by needle id, none null, as many as the simulators have needles
  HandOver<MeshState>::Writer& states;    ///< every tick
  HandOver<TickForces>::Writer& forces;   ///< every tick, before the mesh
  HandOver<DroppedSeeds>::Writer& seeds;  ///< whenever their number or the run changes
  HandOver<LoopStatistics>::Writer& statistics;    ///< ten times a second, and at the end
  HandOver<LoadingPlan>::Reader* plans = nullptr;  ///< changes of the plan; null: there are none
  /// Every tick whose field is its landmarks', for who computes it again: the ultrasound thread, and the dose thread
  /// of HDR; null: there is none.
  std::array<HandOver<ImagedTick>::Writer*, 2> images = {};
  HandOver<SavedTick>::Writer* saves = nullptr;  ///< a tick every so often; null: no session keeps them
  std::uint64_t ticks_per_save = 0;
};

/// The 200 Hz loop, until a stop is requested: wait for the deadline, read each needle's newest pose, step,
/// publish. It begins with `first` and changes to each successor at the next tick.
/// Threads: the deformation thread's whole life. Real-time: no allocation, lock or exception.
void run_deformation_loop(const std::stop_token& stop, Clock& clock, SimulationRun& first,
                          const DeformationPorts& ports);

/// The same deadlines without work: deadlines missed here are missed by the machine. Publishes lateness and
/// overruns.
/// Threads: the control thread's whole life.
void run_control_loop(const std::stop_token& stop, Clock& clock, double period_s,
                      HandOver<LoopStatistics>::Writer& statistics);

}  // namespace brachy
