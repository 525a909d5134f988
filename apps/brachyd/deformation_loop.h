#pragma once

#include <span>
#include <stop_token>

#include "apps/brachyd/fallen_seeds.h"
#include "apps/brachyd/loop_statistics.h"
#include "apps/brachyd/simulation_run.h"
#include "apps/brachyd/tick_forces.h"
#include "core/realtime/triple_buffer.h"
#include "haptics/device.h"

namespace brachy {

/// The 200 Hz loop: wait for the deadline, take each needle's newest pose, step, publish; until `stop` is asked for. It
/// begins with `first`, and goes over to each run that `runs` brings, of the same scene, at its next tick.
/// `devices` by needle id, none null, as many as the simulators have needles.
/// Threads: the deformation thread's whole life. Real-time: no allocation, lock or exception.
void run_deformation_loop(const std::stop_token& stop, SimulationRun& first,
                          TripleBuffer<SimulationRun*>::Reader& runs, std::span<Device* const> devices,
                          TripleBuffer<MeshState>::Writer& states, TripleBuffer<TickForces>::Writer& forces,
                          TripleBuffer<FallenSeeds>::Writer& fallen,
                          TripleBuffer<LoopStatistics>::Writer& statistics);

/// The same deadlines with nothing to do: what it misses, the machine misses. Publishes lateness and overruns.
void run_control_loop(const std::stop_token& stop, double period_s,
                      TripleBuffer<LoopStatistics>::Writer& statistics);

}  // namespace brachy
