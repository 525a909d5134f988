#include "net/broker/relayed_mesh.h"

#include <gtest/gtest.h>

#include "net/wire/frame_assembler.h"
#include "net/wire/frame_encoder.h"
#include "tests/net/fake_simulation.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

/// A simulation, a relay's copy of its mesh, and a viewer behind the relay.
struct RelayedMeshTest : ::testing::Test {
  const Tissue tissue = line_tissue(40);
  FakeSimulation simulation{tissue, 1, 3};
  const TopologyMessage topology = make_topology(tissue, "line");
  const FrameLayout layout = make_layout(tissue, topology);
  RelayedMesh relayed{topology, 3};
  const FrameLayout relayed_layout = make_layout(relayed.tissue(), topology);
  FrameAssembler viewer;
  std::uint64_t sent_tick = 0, viewer_tick = 0, viewer_run = 0;

  static Bytes encoded(const MeshState& state, const FrameLayout& layout, const FrameRequest& request) {
    Bytes body;
    encode_frame(state, layout, 5, request, body);
    return body;
  }
  static FrameMessage decoded(const Bytes& body) {
    FrameMessage frame;
    EXPECT_TRUE(decode_body(body, frame).is_good());
    return frame;
  }
  void relay(bool full = false, std::int64_t offset_ns = 0) {
    relayed.take(decoded(encoded(simulation.state(), layout, {sent_tick, full || sent_tick == 0, true})),
                 offset_ns);
    sent_tick = simulation.state().summary.tick;
  }
  /// As a Server does.
  void show() {
    if (viewer_run != relayed.state().summary.run) viewer_tick = 0;
    viewer_run = relayed.state().summary.run;
    const auto frame =
        decoded(encoded(relayed.state(), relayed_layout, {viewer_tick, viewer_tick == 0, true}));
    EXPECT_EQ(viewer.apply(frame), "");
    viewer_tick = relayed.state().summary.tick;
  }
  void SetUp() override { ASSERT_EQ(viewer.start(topology), ""); }
};

TEST_F(RelayedMeshTest, AFullFrameIsSentOnByteForByte) {
  simulation.steps(7);
  simulation.state().summary.certificate.verdict = Verdict::kInjective;
  simulation.state().summary.lag_mm = 0.375;
  simulation.state().seeds.slots = {sample_seed()};
  simulation.state().seeds.slots[0].id = 1;
  simulation.state().seeds.ticks = {3};
  simulation.state().seeds.count = 1;
  simulation.state().needles.pose_histories[2][5].button = true;
  simulation.state().needles.states[1].shape = sample_frame().needles[0].state.shape;
  relay();
  const FrameRequest all{0, true, true};
  EXPECT_EQ(encoded(relayed.state(), relayed_layout, all), encoded(simulation.state(), layout, all));
}

TEST_F(RelayedMeshTest, AViewerBehindItHasTheSimulationsBitsWheneverItLooks) {
  std::mt19937 random(5);
  for (int i = 0; i < 300; ++i) {
    simulation.steps(1 + static_cast<int>(random() % 5));
    relay(random() % 20 == 0);
    if (random() % 3 == 0) continue;
    show();
    ASSERT_EQ(viewer.positions(), simulation.state().mesh.deformed_vertices) << i;
    EXPECT_EQ(viewer.tick(), simulation.state().summary.tick);
  }
}

TEST_F(RelayedMeshTest, WhatDidNotChangeIsNotSentOn) {
  simulation.steps(3);
  relay();
  show();
  ++simulation.state().summary.tick;  // nothing moved; all of it comes again, because another relay asked
  relay(true);
  const auto frame = decoded(encoded(relayed.state(), relayed_layout, {viewer_tick, false, false}));
  EXPECT_TRUE(frame.ranges.empty());
}

TEST_F(RelayedMeshTest, ASimulationThatBeganAnewIsSentWhole) {
  simulation.steps(50);
  relay();
  show();
  const auto run = relayed.state().summary.run;
  simulation = FakeSimulation(tissue, 9, 3);
  simulation.steps(2);
  sent_tick = 0;
  relay();
  EXPECT_NE(relayed.state().summary.run, run);
  show();
  EXPECT_EQ(viewer.positions(), simulation.state().mesh.deformed_vertices);
  const auto poses = decoded(encoded(relayed.state(), relayed_layout, {0, true, true})).pose_history;
  EXPECT_EQ(poses.size(), 2u) << "none of the run before";
}

TEST_F(RelayedMeshTest, StampsOfTheDaemonsClockAreMovedToOurs) {
  simulation.step();
  simulation.state().summary.publish_ns = 5'000;
  relay(false, 1'000'000);
  const auto frame = decoded(encoded(relayed.state(), relayed_layout, {0, true, true}));
  EXPECT_EQ(frame.publish_ns, 1'005'000);
  EXPECT_EQ(frame.input_received_ns,
            1'000'000 + static_cast<std::int64_t>(simulation.state().summary.tick) + 2);
  EXPECT_EQ(frame.input_sequence, simulation.state().summary.tick + 2000)
      << "of the needle whose pose came last";
}

TEST_F(RelayedMeshTest, ALagThatAnEarlierDaemonDoesNotTellIsNotToldAsZero) {
  simulation.step();
  simulation.state().summary.lag_mm = Certificate::kNotKnown;
  relay();
  EXPECT_TRUE(std::isnan(decoded(encoded(relayed.state(), relayed_layout, {0, true, true})).lag_mm));
}

TEST_F(RelayedMeshTest, NeedlesWithoutForcesStaySo) {
  simulation.step();
  simulation.state().needles.states[1].forces.axial_n = Certificate::kNotKnown;
  relay();
  const auto frame = decoded(encoded(relayed.state(), relayed_layout, {0, true, true}));
  ASSERT_EQ(frame.needles.size(), 3u);
  EXPECT_TRUE(frame.needles[0].has_forces);
  EXPECT_FALSE(frame.needles[1].has_forces);
}

TEST_F(RelayedMeshTest, FramesOfMoreNeedlesThanTheWelcomeSaidAreTaken) {
  simulation.steps(2);
  RelayedMesh one(topology, 1);
  one.take(decoded(encoded(simulation.state(), layout, {0, true, true})), 0);
  EXPECT_EQ(decoded(encoded(one.state(), relayed_layout, {0, true, true})).needles.size(), 1u);
}

}  // namespace
}  // namespace brachy::net::test
