// The 200 Hz loop in virtual time: its deadlines, and what it counts.
#include "apps/daemon/loops/deformation_loop.h"

#include <gtest/gtest.h>

#include <functional>
#include <stop_token>
#include <vector>

#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "tests/apps/running_daemon.h"
#include "tests/net/manual_clock.h"

namespace brachy {
namespace {

constexpr std::int64_t kPeriodNs = 5'000'000;

/// Notes when it is asked; gives no pose.
class NotingDevice final : public Device {
 public:
  bool update(std::int64_t now_ns, NeedlePose&) override {
    asked_ns.push_back(now_ns);
    on_asked(asked_ns.size());
    return false;
  }
  std::vector<std::int64_t> asked_ns;
  std::function<void(std::size_t tick)> on_asked;
};

TEST(DeformationLoop, ThatWasStoppedMissesItsDeadlinesAndMakesUpForNone) {
  const Scene scene = test::small();
  net::test::ManualClock clock;
  SimulationRun run(0, false, load_simulation_model(scene, load_tissue(scene).tissue));
  HandOver<SimulationRun*> runs;
  HandOver<MeshState> states(run.simulator.initial_state());
  HandOver<TickForces> forces(TickForces(1));
  HandOver<DroppedSeeds> seeds(DroppedSeeds(run.simulator.initial_state()));
  HandOver<LoopStatistics> statistics;
  std::stop_source stop;
  NotingDevice device;
  device.on_asked = [&](std::size_t tick) {
    if (tick == 10) clock.advance(std::chrono::nanoseconds(400 * kPeriodNs + kPeriodNs / 5));  // SIGSTOP
    if (tick == 30) stop.request_stop();
  };
  Device* const devices[] = {&device};
  run_deformation_loop(stop.get_token(), clock, run,
                       {runs.reader, devices, states.writer, forces.writer, seeds.writer, statistics.writer});
  ASSERT_EQ(device.asked_ns.size(), 30u);
  for (std::size_t i = 0; i < 30; ++i) {
    const auto deadline = static_cast<std::int64_t>(i < 10 ? i + 1 : i + 1 + 400);
    EXPECT_EQ(device.asked_ns[i] - net::test::ManualClock::kBeginNs, deadline * kPeriodNs) << i;
  }
  ASSERT_TRUE(statistics.reader.update());
  const LoopStatistics& measured = statistics.reader.value();
  EXPECT_EQ(measured.ticks, 30u);
  EXPECT_EQ(measured.overruns, 400u);
  EXPECT_EQ(measured.longest_overrun, 400u);
  EXPECT_EQ(measured.lateness_ns.max(), 0);
  EXPECT_EQ(measured.tick_ns.max(), 400 * kPeriodNs + kPeriodNs / 5);
  ASSERT_TRUE(states.reader.update());
  EXPECT_EQ(states.reader.value().summary.tick, 30u);
  EXPECT_EQ(states.reader.value().summary.overruns, 400u);
  EXPECT_EQ(states.reader.value().summary.publish_ns, clock.now_ns());
}

// From a tick that it has saved another simulator goes on as the loop did; saving takes no memory.
TEST(DeformationLoop, SavesATickEverySoOften) {
  const Scene scene = test::small();
  net::test::ManualClock clock;
  const auto model = load_simulation_model(scene, load_tissue(scene).tissue);
  SimulationRun run(0, false, model);
  HandOver<SimulationRun*> runs;
  HandOver<MeshState> states(run.simulator.initial_state());
  HandOver<TickForces> forces(TickForces(1));
  HandOver<DroppedSeeds> seeds(DroppedSeeds(run.simulator.initial_state()));
  HandOver<LoopStatistics> statistics;
  HandOver<SavedTick> saves{SavedTick(run.simulator)};
  const std::byte* const memory = saves.writer.slot().bytes.data();
  std::stop_source stop;
  NotingDevice device;
  device.on_asked = [&](std::size_t tick) {
    if (tick == 45) stop.request_stop();
  };
  Device* const devices[] = {&device};
  DeformationPorts ports{runs.reader, devices, states.writer, forces.writer, seeds.writer, statistics.writer};
  ports.saves = &saves.writer;
  ports.ticks_per_save = 40;
  run_deformation_loop(stop.get_token(), clock, run, ports);
  ASSERT_TRUE(saves.reader.update());
  EXPECT_EQ(saves.reader.value().tick, 40u);
  EXPECT_EQ(saves.reader.value().bytes.data(), memory);
  Simulator again(model);
  again.restore(saves.reader.value().bytes);
  MeshState slot = again.initial_state();
  again.step(NeedlePose{}, slot);
  EXPECT_EQ(slot.summary.tick, 41u);
}

}  // namespace
}  // namespace brachy
