#include "net/wire/frame_assembler.h"

#include <gtest/gtest.h>

#include <cmath>

#include "net/wire/codec.h"
#include "net/wire/frame_encoder.h"
#include "tests/net/net_testing.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

struct FrameAssemblerTest : ::testing::Test {
  FrameMessage frame(const FrameRequest& request) {
    Bytes body;
    encode_frame(simulation.state(), make_layout(tissue, topology), 1, request, body);
    FrameMessage decoded;
    const DecodeResult result = decode_body(body, decoded);
    EXPECT_TRUE(result.is_good()) << result.reason;
    return decoded;
  }

  Tissue tissue = line_tissue(30);
  TopologyMessage topology = make_topology(tissue, "line");
  FakeSimulation simulation{tissue};
  FrameAssembler mesh;
};

TEST_F(FrameAssemblerTest, StaysBitwiseEqualHoweverManyTicksAreSkipped) {
  ASSERT_EQ(mesh.start(topology), "");
  EXPECT_EQ(mesh.positions(), topology.rest_vertices);
  simulation.steps(3);
  ASSERT_EQ(mesh.apply(frame({0, true, false})), "");
  for (int skipped = 0; skipped < 40; ++skipped) {
    simulation.steps(1 + skipped % 7);
    ASSERT_EQ(mesh.apply(frame({mesh.tick(), false, false})), "");
    ASSERT_EQ(mesh.positions(), simulation.state().mesh.deformed_vertices);
    ASSERT_EQ(mesh.tick(), simulation.state().summary.tick);
  }
}

TEST_F(FrameAssemblerTest, OnlyChangedBlocksTravelAndNeighboursShareARange) {
  simulation.steps(1);
  const FrameMessage changes = frame({0, false, false});
  std::size_t changed_blocks = 0;
  for (const auto tick : simulation.state().mesh.block_ticks) changed_blocks += tick > 0;
  EXPECT_EQ(changes.positions.size(), 15 * changed_blocks);
  EXPECT_LT(changed_blocks, tissue.blocks.size());
  for (std::size_t i = 1; i < changes.ranges.size(); ++i) {
    EXPECT_GT(changes.ranges[i].first, changes.ranges[i - 1].first + changes.ranges[i - 1].count);
  }
  EXPECT_TRUE(frame({1, false, false}).ranges.empty());
}

TEST_F(FrameAssemblerTest, EveryFrameCarriesTheTicksCertificateFlagsAndLag) {
  MeshState state = simulation.state();
  state.summary.step_flags = kStepFolded | kStepClamped | kStepLate;
  state.summary.lag_mm = 0.25;
  state.summary.certificate.verdict = Verdict::kFolded;
  state.summary.certificate.det_bound = Certificate::kNotKnown;
  state.summary.certificate.vertex_det = -0.25;
  state.summary.certificate.place = {1, 2, 3};
  state.summary.certificate.held_mm = 2.1;
  for (const bool full : {true, false}) {
    Bytes body;
    encode_frame(state, make_layout(tissue, topology), 1, {0, full, false}, body);
    FrameMessage decoded;
    ASSERT_TRUE(decode_body(body, decoded).is_good());
    ASSERT_TRUE(decoded.certificate);
    EXPECT_EQ(decoded.certificate->verdict, Verdict::kFolded);
    EXPECT_TRUE(std::isnan(decoded.certificate->det_bound));
    EXPECT_EQ(decoded.certificate->vertex_det, -0.25);
    EXPECT_EQ(decoded.certificate->place, Vec3(1, 2, 3));
    EXPECT_EQ(decoded.certificate->held_mm, 2.1);
    EXPECT_EQ(decoded.step_flags, kStepFolded | kStepClamped | kStepLate);
    EXPECT_EQ(decoded.lag_mm, 0.25);
  }
}

TEST_F(FrameAssemblerTest, AFramesLagIsThatOfTheTickWhoseMeshItHolds) {
  ASSERT_EQ(mesh.start(topology), "");
  for (const double lag_mm : {0.0, 2.0, 0.5}) {  // of each tick; the second has no frame
    simulation.step();
    simulation.state().summary.lag_mm = lag_mm;
    if (lag_mm == 2) continue;
    const FrameMessage sent = frame({mesh.tick(), mesh.tick() == 0, false});
    ASSERT_EQ(mesh.apply(sent), "");
    EXPECT_EQ(sent.lag_mm, lag_mm);
  }
}

TEST_F(FrameAssemblerTest, EveryFrameCarriesTheShapesOfTheNeedlesThatBend) {
  simulation.steps(3);
  MeshState state = simulation.state();
  NeedleShape& shape = state.needles.states[0].shape;
  const NeedleShape sent = shape = sample_frame().needles[0].state.shape;
  for (const FrameRequest& request : {FrameRequest{0, true, false}, FrameRequest{2, false, true, true}}) {
    Bytes body;
    FrameMessage decoded;
    encode_frame(state, make_layout(tissue, topology), 1, request, body);
    ASSERT_TRUE(decode_body(body, decoded).is_good());
    EXPECT_TRUE(decoded.needles[0].state.shape.is_bent);
    EXPECT_EQ(decoded.needles[0].state.shape.points, sent.points);
  }
  shape.points[3].y() = std::nan("");
  Bytes body;
  FrameMessage decoded;
  encode_frame(state, make_layout(tissue, topology), 1, {0, true, false}, body);
  ASSERT_TRUE(decode_body(body, decoded).is_good()) << "what is not finite is not sent";
  EXPECT_FALSE(decoded.needles[0].state.shape.is_bent);
}

TEST_F(FrameAssemblerTest, AFrameMayBeWithoutNeedles) {
  simulation.steps(3);
  MeshState state = simulation.state();
  state.needles.states.clear();
  state.needles.pose_histories.clear();
  Bytes body;
  encode_frame(state, make_layout(tissue, topology), 1, {0, true, true}, body);
  FrameMessage decoded;
  ASSERT_TRUE(decode_body(body, decoded).is_good());
  EXPECT_TRUE(decoded.needles.empty());
  EXPECT_TRUE(decoded.pose_history.empty());
  EXPECT_EQ(decoded.input_sequence, 0u);
  ASSERT_EQ(mesh.start(topology), "");
  ASSERT_EQ(mesh.apply(decoded), "");
  EXPECT_EQ(mesh.positions(), state.mesh.deformed_vertices);
}

TEST_F(FrameAssemblerTest, ChangesSinceEarlierThanItsTickAreFine) {
  mesh.start(topology);
  simulation.steps(5);
  mesh.apply(frame({0, true, false}));
  simulation.steps(2);
  EXPECT_EQ(mesh.apply(frame({3, false, false})), "");
  EXPECT_EQ(mesh.positions(), simulation.state().mesh.deformed_vertices);
}

TEST_F(FrameAssemblerTest, RefusesWhatItCannotApplyAndStaysAsItWas) {
  simulation.steps(5);
  EXPECT_NE(mesh.apply(frame({0, true, false})), "");  // no topology
  mesh.start(topology);
  EXPECT_NE(mesh.apply(frame({0, false, false})), "");  // not full
  ASSERT_EQ(mesh.apply(frame({0, true, false})), "");
  const auto before = mesh.positions();
  simulation.steps(5);
  EXPECT_NE(mesh.apply(frame({7, false, false})), "");  // base later than its tick
  FrameMessage other = frame({5, false, false});
  other.topology_hash ^= 1;
  EXPECT_NE(mesh.apply(other), "");
  other = frame({5, false, false});
  other.point_count += 1;
  EXPECT_NE(mesh.apply(other), "");
  other = frame({2, false, false});
  other.tick = 4;
  EXPECT_NE(mesh.apply(other), "");  // older than its tick
  EXPECT_EQ(mesh.positions(), before);
  EXPECT_EQ(mesh.tick(), 5u);
}

TEST_F(FrameAssemblerTest, RefusesATopologyWhoseHashIsNotItsContents) {
  topology.rest_vertices[4] += 1;
  EXPECT_NE(mesh.start(topology), "");
}

TEST_F(FrameAssemblerTest, PoseHistoryHoldsEveryTickSinceTheLastFrameThatTheRingHas) {
  simulation.steps(10);
  const auto recent = frame({6, false, true}).pose_history;
  ASSERT_EQ(recent.size(), 4u);
  EXPECT_EQ(recent.front().tick, 7u);
  EXPECT_EQ(recent.back().tick, 10u);
  EXPECT_EQ(recent.back().X_WN.p.x(), 10);
  EXPECT_EQ(frame({6, true, true}).pose_history.size(), 4u);  // a full frame does not repeat them
  EXPECT_FALSE(frame({6, false, false}).has_pose_history);
  simulation.steps(500);
  const auto all = frame({6, false, true}).pose_history;
  ASSERT_EQ(all.size(), NeedleStates::kPoseHistory);
  EXPECT_EQ(all.front().tick, 510 - NeedleStates::kPoseHistory + 1);
}

// Seeds fall and move; a receiver that skips ticks receives what it lacks, and has the server's seeds.
TEST_F(FrameAssemblerTest, SeedsArriveOnceAndMoveAfterwards) {
  MeshState& state = simulation.state();
  state.seeds.slots.resize(8);
  state.seeds.ticks.resize(8);
  ASSERT_EQ(mesh.start(topology), "");
  simulation.step();
  ASSERT_EQ(mesh.apply(frame({0, true, false})), "");
  EXPECT_TRUE(mesh.seeds().empty());
  const auto touch = [&](std::size_t i) {
    state.seeds.slots[i].id = static_cast<std::uint32_t>(i + 1);
    state.seeds.slots[i].position.x() += 1;
    state.seeds.ticks[i] = state.summary.tick;
    state.seeds.count = std::max(state.seeds.count, static_cast<std::uint32_t>(i + 1));
  };
  const std::vector<std::vector<std::size_t>> touched = {{0}, {}, {0, 1}, {1}, {2, 3}, {0, 3}};
  for (std::size_t k = 0; k < touched.size(); ++k) {
    simulation.step();
    for (const std::size_t i : touched[k]) touch(i);
    if (k % 2 == 0) continue;  // not sent
    const FrameMessage changes = frame({mesh.tick(), false, false});
    EXPECT_LT(changes.seeds.size(), 4u);
    ASSERT_EQ(mesh.apply(changes), "");
    EXPECT_TRUE(std::ranges::equal(mesh.seeds(), state.seeds.in_tissue())) << k;
  }
  FrameAssembler late;
  ASSERT_EQ(late.start(topology), "");
  ASSERT_EQ(late.apply(frame({0, true, false})), "");
  EXPECT_TRUE(std::ranges::equal(late.seeds(), state.seeds.in_tissue()));
}

TEST_F(FrameAssemblerTest, AFrameThatLacksANewSeedIsRefusedAndChangesNothing) {
  MeshState& state = simulation.state();
  state.seeds.slots.resize(2);
  state.seeds.ticks.resize(2);
  ASSERT_EQ(mesh.start(topology), "");
  simulation.step();
  ASSERT_EQ(mesh.apply(frame({0, true, false})), "");
  simulation.step();
  state.seeds.slots[0].id = 1;
  state.seeds.ticks[0] = state.summary.tick;
  state.seeds.count = 1;
  FrameMessage lacking = frame({mesh.tick(), false, false});
  lacking.seeds.clear();
  EXPECT_NE(mesh.apply(lacking), "");
  EXPECT_TRUE(mesh.seeds().empty());
}

}  // namespace
}  // namespace brachy::net::test
