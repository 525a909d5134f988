#include "apps/daemon/telemetry/tick_events.h"

#include <gtest/gtest.h>

namespace brachy {
namespace {

MeshState state_of(std::uint64_t tick, std::uint64_t run, Verdict verdict = Verdict::kInjective) {
  MeshState state;
  state.summary.run = run;
  state.summary.tick = tick;
  state.summary.sim_time_s = 0.005 * static_cast<double>(tick);
  state.needles.states.resize(1);
  state.seeds.slots.resize(4);
  state.summary.certificate.verdict = verdict;
  return state;
}

TEST(TickEvents, OfASimulationAnewOnlyWhatItBroughtItselfIsTold) {
  MeshState old = state_of(0, 0);
  TickEvents events(old, {});
  old.summary.tick = 20'000;
  old.summary.sim_time_s = 100;
  old.needles.states[0].puncture_count = 3;
  old.needles.states[0].drops.refused = 2;
  old.seeds.count = 2;
  events.update(old);
  EXPECT_EQ(events.seeds_dropped(), 2u);

  EXPECT_TRUE(events.update(state_of(5, 1)).empty());
  MeshState restarted = state_of(10, 1);
  restarted.needles.states[0].puncture_count = 1;
  restarted.needles.states[0].drops.refused = 1;
  restarted.seeds.count = 1;
  const auto reported = events.update(restarted);
  ASSERT_EQ(reported.size(), 3u);
  EXPECT_EQ(reported[0].kind, net::EventKind::kPuncture);
  EXPECT_EQ(events.seeds_dropped(), 3u);
  EXPECT_EQ(events.drops_refused(), 3u);
}

TEST(TickEvents, WarningsPassAlsoAfterTheTimeHasGoneBack) {
  TickEvents events(state_of(0, 0), {});
  for (std::uint64_t i = 0; i < 8; ++i)  // more than pass at once
    events.update(state_of(20'000 + i, 0, i % 2 ? Verdict::kInjective : Verdict::kFolded));
  EXPECT_TRUE(events.update(state_of(1, 1)).empty());
  const auto reported = events.update(state_of(2, 1, Verdict::kFolded));
  ASSERT_EQ(reported.size(), 1u);
  EXPECT_EQ(reported[0].kind, net::EventKind::kWarning);
}

TEST(TickEvents, AnotherModelKeepsSeedsAndCounts) {
  MeshState old = state_of(0, 0);
  TickEvents events(old, {});
  old.summary.tick = 100;
  old.needles.states[0].drops.refused = 2;
  old.seeds.count = 2;
  events.update(old);
  old.summary.run = 1;
  old.summary.tick = 101;
  EXPECT_TRUE(events.update(old).empty());
  EXPECT_EQ(events.seeds_dropped(), 2u);
  EXPECT_EQ(events.drops_refused(), 2u);
}

}  // namespace
}  // namespace brachy
