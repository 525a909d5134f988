#include "apps/daemon/loops/deformation_loop.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace brachy {
namespace {

std::int64_t to_ns(double seconds) {
  return std::llround(seconds * 1e9);
}

SimulationRun* begin(SimulationRun& next, const SimulationRun& last) {
  if (next.resumes) next.simulator.resume_from(last.simulator);
  return &next;
}

void publish(const LoopStatistics& measured, HandOver<LoopStatistics>::Writer& statistics) {
  statistics.slot() = measured;
  statistics.publish();
}

constexpr std::uint64_t kTicksPerReport = 20;  // statistics are 24 kB: ten times a second is enough

}  // namespace

void run_deformation_loop(const std::stop_token& stop, Clock& clock, SimulationRun& first,
                          const DeformationPorts& ports) {
  SimulationRun* run = &first;
  const std::int64_t period_ns = to_ns(run->simulator.period_s());
  DeadlineTimer timer(period_ns, clock.now_ns() + period_ns, clock);
  LoopStatistics measured;
  const std::size_t needles = ports.devices.size();
  std::vector<NeedlePose> poses(needles);
  std::vector<char> is_fresh(needles);
  std::uint32_t seeds_published = ports.states.slot().seeds.count;
  std::uint64_t run_published = run->number, failed_published = ports.states.slot().failed_drops.count;
  while (!stop.stop_requested()) {
    measured.lateness_ns.record(timer.wait());
    measured.count_overruns(timer.overruns());
    const std::int64_t start_ns = clock.now_ns();

    for (std::size_t n = 0; n < needles; ++n) is_fresh[n] = ports.devices[n]->update(start_ns, poses[n]);
    // First: a run that resumes goes on with the plan of the one before, one that restarts has the scene's.
    if (ports.plans && ports.plans->update()) run->simulator.set_plan(ports.plans->value());
    if (ports.runs.update()) run = begin(*ports.runs.value(), *run);
    MeshState& state = ports.states.slot();
    if (state.summary.run != run->number) run->swap_slot(state);
    run->simulator.step(std::span<const NeedlePose>(poses), state);
    TickSummary& summary = state.summary;
    ports.forces.slot().copy_from(state);
    ports.forces.slot().start_ns = start_ns;
    ports.forces.publish();
    summary.overruns = measured.overruns;
    measured.certificates.add(summary, changes_are_finite(state, run->simulator.tissue().blocks));
    std::array<bool, 2> is_imaged{};
    for (std::size_t i = 0; i < is_imaged.size(); ++i)
      is_imaged[i] = ports.images[i] && ports.images[i]->slot().copy_from(run->simulator, state);
    summary.publish_ns = clock.now_ns();
    for (std::size_t i = 0; i < is_imaged.size(); ++i) {
      if (!is_imaged[i]) continue;
      ports.images[i]->slot().publish_ns = summary.publish_ns;
      ports.images[i]->publish();
    }
    if (state.seeds.count != seeds_published || state.failed_drops.count != failed_published ||
        summary.run != run_published) {
      seeds_published = state.seeds.count;
      failed_published = state.failed_drops.count;
      run_published = summary.run;
      ports.seeds.slot().copy_from(state);
      ports.seeds.slot().publish_ns = summary.publish_ns;
      ports.seeds.publish();
    }

    if (ports.saves && summary.tick % ports.ticks_per_save == 0) {
      run->simulator.save(ports.saves->slot().bytes);
      ports.saves->slot().tick = summary.tick;
      ports.saves->publish();
    }
    ++measured.ticks;
    measured.tick_ns.record(summary.publish_ns - start_ns);
    for (std::size_t n = 0; n < needles; ++n)
      if (is_fresh[n]) measured.latency_ns.record(summary.publish_ns - poses[n].received_ns);
    measured.max_displacement_mm = std::max(measured.max_displacement_mm, summary.max_displacement_mm);
    measured.moved_vertices = std::max(measured.moved_vertices, summary.moved_vertices);
    for (const NeedleState& needle : state.needles.states)
      measured.max_tip_deflection_mm =
          std::max(measured.max_tip_deflection_mm, needle.shape.tip_deflection_mm());
    ports.states.publish();
    if (measured.ticks % kTicksPerReport == 0) publish(measured, ports.statistics);
  }
  publish(measured, ports.statistics);
}

void run_control_loop(const std::stop_token& stop, Clock& clock, double period_s,
                      HandOver<LoopStatistics>::Writer& statistics) {
  DeadlineTimer timer(to_ns(period_s), clock.now_ns() + to_ns(period_s), clock);
  LoopStatistics measured;
  while (!stop.stop_requested()) {
    measured.lateness_ns.record(timer.wait());
    ++measured.ticks;
    measured.count_overruns(timer.overruns());
    if (measured.ticks % kTicksPerReport == 0) publish(measured, statistics);
  }
  publish(measured, statistics);
}

}  // namespace brachy
