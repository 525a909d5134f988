#include "apps/brachyd/deformation_loop.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/realtime/deadline.h"

namespace brachy {
namespace {

std::int64_t to_ns(double seconds) {
  return std::llround(seconds * 1e9);
}

SimulationRun* begin(SimulationRun& next, const SimulationRun& last) {
  if (next.goes_on) next.simulator.go_on_from(last.simulator);
  return &next;
}

constexpr std::uint64_t kTicksPerReport = 20;  // statistics are 24 kB: ten times a second is enough

}  // namespace

void run_deformation_loop(const std::stop_token& stop, SimulationRun& first,
                          TripleBuffer<SimulationRun*>::Reader& runs, std::span<Device* const> devices,
                          TripleBuffer<MeshState>::Writer& states, TripleBuffer<TickForces>::Writer& forces,
                          TripleBuffer<FallenSeeds>::Writer& fallen,
                          TripleBuffer<LoopStatistics>::Writer& statistics) {
  SimulationRun* run = &first;
  const std::int64_t period_ns = to_ns(run->simulator.period_s());
  DeadlineTimer timer(period_ns, monotonic_ns() + period_ns);
  LoopStatistics measured;
  std::vector<NeedlePose> poses(devices.size());
  std::vector<char> is_fresh(devices.size());
  std::uint32_t seeds_told = states.slot().seed_count;
  std::uint64_t run_told = run->number;
  while (!stop.stop_requested()) {
    measured.lateness_ns.record(timer.wait());
    measured.count_overruns(timer.overruns());
    const std::int64_t start_ns = monotonic_ns();

    for (std::size_t n = 0; n < devices.size(); ++n) is_fresh[n] = devices[n]->update(start_ns, poses[n]);
    if (runs.update()) run = begin(*runs.value(), *run);
    MeshState& state = states.slot();
    if (state.run != run->number) run->fit(state);
    run->simulator.step(std::span<const NeedlePose>(poses), state);
    forces.slot().copy_from(state);
    forces.slot().start_ns = start_ns;
    forces.publish();
    state.overruns = measured.overruns;
    measured.certificates.add(state.certificate, state.step_flags,
                              changes_are_finite(state, run->simulator.tissue().blocks));
    state.publish_ns = monotonic_ns();
    if (state.seed_count != seeds_told || state.run != run_told) {
      seeds_told = state.seed_count;
      run_told = state.run;
      fallen.slot().copy_from(state);
      fallen.slot().publish_ns = state.publish_ns;
      fallen.publish();
    }

    ++measured.ticks;
    measured.tick_ns.record(state.publish_ns - start_ns);
    for (std::size_t n = 0; n < devices.size(); ++n)
      if (is_fresh[n]) measured.latency_ns.record(state.publish_ns - poses[n].received_ns);
    measured.max_displacement_mm = std::max(measured.max_displacement_mm, state.max_displacement_mm);
    measured.moved_vertices = std::max(measured.moved_vertices, state.moved_vertices);
    states.publish();
    if (measured.ticks % kTicksPerReport == 0) {
      statistics.slot() = measured;
      statistics.publish();
    }
  }
  statistics.slot() = measured;
  statistics.publish();
}

void run_control_loop(const std::stop_token& stop, double period_s,
                      TripleBuffer<LoopStatistics>::Writer& statistics) {
  DeadlineTimer timer(to_ns(period_s), monotonic_ns() + to_ns(period_s));
  LoopStatistics measured;
  while (!stop.stop_requested()) {
    measured.lateness_ns.record(timer.wait());
    ++measured.ticks;
    measured.count_overruns(timer.overruns());
    if (measured.ticks % kTicksPerReport == 0) {
      statistics.slot() = measured;
      statistics.publish();
    }
  }
  statistics.slot() = measured;
  statistics.publish();
}

}  // namespace brachy
