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
  restarted.failed_drops.count = 1;
  restarted.failed_drops.slots[0].why = DropRefusal::kNothingLoaded;
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

TEST(TickEvents, ANeedleThatEntersAnOrganAndLeavesItIsToldBoth) {
  MeshState state = state_of(0, 0);
  TickEvents events(state, {}, {"urethra", "pubic_arch"});
  state.needles.organ_contacts.resize(2);
  EXPECT_TRUE(events.update(state).empty());
  OrganContact& urethra = state.needles.organ_contacts[0];
  urethra.is_in = true;
  urethra.passes = 1;
  urethra.entered_tick = 40;
  auto told = events.update(state);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].kind, net::EventKind::kStructure);
  EXPECT_EQ(told[0].tick, 40u);
  EXPECT_EQ(told[0].text, "the needle entered the urethra");
  EXPECT_TRUE(events.update(state).empty());
  urethra.is_in = false;
  urethra.left_tick = 90;
  urethra.depth_mm = 2.5;
  urethra.time_s = 0.25;
  told = events.update(state);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].tick, 90u);
  EXPECT_EQ(told[0].text, "the needle left the urethra: 2.5 mm deep, 0.25 s");
  state.needles.organ_contacts[1] = {.is_in = true, .passes = 1, .entered_tick = 99};
  told = events.update(state);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].text, "the needle met bone: the pubic arch");
}

TEST(TickEvents, ALostSeedHasAnEventOfItsOwnAndARefusedOneItsReason) {
  MeshState state = state_of(0, 0);
  TickEvents events(state, {});
  state.failed_drops.count = 2;
  state.failed_drops.slots[0] = {10, 0.05, 0, 3, DropRefusal::kLost, Vec3(1, 2, -80)};
  state.failed_drops.slots[1] = {12, 0.06, 0, -1, DropRefusal::kNothingLoaded, Vec3::Zero()};
  const auto told = events.update(state);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].kind, net::EventKind::kSeedLost);
  EXPECT_EQ(told[0].tick, 10u);
  EXPECT_NE(told[0].text.find("(1.0, 2.0, -80.0) mm"), std::string::npos) << told[0].text;
  EXPECT_EQ(told[1].kind, net::EventKind::kSeed);
  EXPECT_NE(told[1].text.find("the needle is empty"), std::string::npos) << told[1].text;
  EXPECT_TRUE(events.update(state).empty());
}

}  // namespace
}  // namespace brachy
