// What OpenIGTLink's clients get beside surface and poses: points, errors, frames, status, rates; and commands.
#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "net/igtl/codec/big_endian.h"
#include "tests/net/igtl/igtl_fixture.h"

namespace brachy::net::igtl {
namespace {

constexpr auto kSilent = std::chrono::hours(1);  // no stream of itself

struct IgtlContent : test::IgtlFixture {
  void drop_seed(const Vec3& position) {
    SeedStates& seeds = simulation.state().seeds;
    seeds.slots.resize(8);
    seeds.ticks.resize(8);
    Seed& seed = seeds.slots[seeds.count];
    seed.id = seeds.count + 1;
    seed.position = position;
    seeds.ticks[seeds.count++] = simulation.state().summary.tick + 1;
  }
  Bytes start_tracking(std::uint32_t period_ms) {
    Bytes start = encode_empty("STT_TDATA", {1, "TDataClient", 0});
    put(start, period_ms);
    start.resize(start.size() + 32);
    return test::with_right_size_and_crc(start);
  }
  Bytes text(const std::string& words) {
    Bytes message = encode_empty("STRING", {1, "Slicer", 0});
    put(message, std::uint16_t{3});
    put(message, static_cast<std::uint16_t>(words.size()));
    put_name(message, words, words.size());
    return test::with_right_size_and_crc(message);
  }
  Bytes command(const std::string& name) {
    Bytes message = encode_empty("COMMAND", {1, "Slicer", 0});
    put(message, std::uint32_t{42});
    put_name(message, name, 128);
    put(message, std::uint16_t{3});
    put(message, std::uint32_t{0});
    return test::with_right_size_and_crc(message);
  }
};

TEST_F(IgtlContent, SeedsAreSentWhenTheyFallOrMoveAndTargetsOnce) {
  IgtlOptions own;
  own.first_message_wait = {};
  own.targets = {Vec3(1, 2, 3), Vec3(4, 5, 6)};
  start_both({}, own);
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("POLYDATA") >= 3; }));
  EXPECT_EQ(peer.count("POINT", "Targets"), 1u);
  EXPECT_EQ(peer.last("POINT", "Targets").named_points()[1],
            (std::pair<std::string, Vec3>("Target 2", {4, 5, 6})));
  EXPECT_EQ(peer.count("POINT", "Seeds"), 0u) << "none has fallen";
  drop_seed({7, 8, 9});
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("POINT", "Seeds") == 1; }));
  EXPECT_EQ(peer.last("POINT", "Seeds").named_points(),
            (std::vector<std::pair<std::string, Vec3>>{{"Seed 1", {7, 8, 9}}}));
  const std::size_t surfaces = peer.count("POLYDATA");
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("POLYDATA") >= surfaces + 3; }));
  EXPECT_EQ(peer.count("POINT", "Seeds"), 1u) << "it has not moved";
}

TEST_F(IgtlContent, PointsAreAnsweredByName) {
  IgtlOptions own;
  own.first_message_wait = kSilent;
  own.targets = {Vec3(1, 2, 3)};
  start_both({}, own);
  simulation.steps(5);
  drop_seed({7, 8, 9});
  igtl->publish(simulation.snapshot());
  test::IgtlPeer peer(io, igtl->port());
  for (const char* name : {"Seeds", "Targets", "Nothing"}) ASSERT_TRUE(peer.send_query("GET_POINT", name));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("POINT") == 3; }));
  EXPECT_EQ(peer.last("POINT", "Seeds").named_points().size(), 1u);
  EXPECT_EQ(peer.last("POINT", "Targets").named_points().size(), 1u);
  EXPECT_EQ(peer.last("POINT", "Nothing").named_points().size(), 0u);
}

TEST_F(IgtlContent, TheTipsErrorIsTheWayToTheNearestTarget) {
  IgtlOptions own;
  own.first_message_wait = kSilent;
  own.targets = {Vec3(100, 0, 0), Vec3(0, 0, -50)};
  start_both({}, own);
  simulation.steps(5);
  NeedleState& needle = simulation.state().needles.states[0];
  needle.X_WN = at(0, 3, -48);
  igtl->publish(simulation.snapshot());
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_TRANS", "ErrorToRas"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM", "ErrorToRas") == 1; }));
  EXPECT_EQ(peer.last("TRANSFORM").transform().p, Vec3(0, -3, -2));
}

// It was sent as Needle1ToRas, with Error1ToRas to a seed, and NeedleToRas became Needle0ToRas.
TEST_F(IgtlContent, AProbeIsNoNeedle) {
  simulation.state().needles.states.resize(2);
  simulation.state().needles.pose_histories.resize(2);
  IgtlOptions own;
  own.first_message_wait = std::chrono::milliseconds(0);
  own.targets = {Vec3(1, 2, 3)};
  own.naming.probe = 1;
  ServerOptions options;
  options.needles = 2;
  options.probe_needle = 1;
  start_both(options, own);
  simulation.steps(5);
  for (NeedleState& state : simulation.state().needles.states) state.present = true;
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("TRANSFORM", "ProbeToRas") > 2; }));
  std::set<std::string> names;
  for (const test::Received& message : peer.received)
    if (message.header.type == "TRANSFORM") names.insert(message.header.device);
  EXPECT_EQ(names, (std::set<std::string>{"NeedleToRas", "ForceToRas", "ErrorToRas", "ProbeToRas"}));
}

// PLUS's trackers may send poses without a time between others.
TEST_F(IgtlContent, APoseWithoutAStampIsOfWhenItCame) {
  start_igtl(kSilent);
  test::IgtlPeer peer(io, igtl->port());
  const auto send = [&](std::uint64_t timestamp) {
    clock.advance(std::chrono::milliseconds(10));
    const std::size_t before = poses.size();
    EXPECT_TRUE(peer.send(encode_transform({1, "NeedleToRas", timestamp}, at(0, 0, 1))));
    EXPECT_TRUE(until_read(peer, [&] { return poses.size() > before; }));
    return poses.back().stamp_ns;
  };
  const std::uint64_t now = to_timestamp(1'700'000'000'000'000'000);
  const std::int64_t first = send(now), second = send(0), third = send(0);
  EXPECT_NEAR(static_cast<double>(second - first), 1e7, 2);
  EXPECT_NEAR(static_cast<double>(third - second), 1e7, 2);
  // Two that came together are one after the other.
  Bytes two = encode_transform({1, "NeedleToRas", 0}, at(0, 0, 2));
  const Bytes next = encode_transform({1, "NeedleToRas", 0}, at(0, 0, 3));
  two.insert(two.end(), next.begin(), next.end());
  const std::size_t before = poses.size();
  ASSERT_TRUE(peer.send(two));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == before + 2; }));
  EXPECT_LT(third, poses[before].stamp_ns);
  EXPECT_LT(poses[before].stamp_ns, poses[before + 1].stamp_ns);
}

TEST_F(IgtlContent, ABentNeedlesCourseIsPointsFromHubToTip) {
  start_igtl(kSilent);
  simulation.steps(5);
  NeedleShape& shape = simulation.state().needles.states[0].shape;
  shape.is_bent = true;
  for (std::size_t i = 0; i < NeedleShape::kPoints; ++i)
    shape.points[i] = Vec3(0, static_cast<double>(i), -200);
  igtl->publish(simulation.snapshot());
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_POINT", "NeedleShape"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("POINT", "NeedleShape") == 1; }));
  const auto points = peer.last("POINT").named_points();
  ASSERT_EQ(points.size(), NeedleShape::kPoints);
  EXPECT_EQ(points.back(), (std::pair<std::string, Vec3>("NeedleShape 16", {0, 16, -200})));
}

TEST_F(IgtlContent, AllCoordinatesAreInTheScenesFrame) {
  IgtlOptions own;
  own.first_message_wait = {};
  own.naming.frame = "Lps";
  own.naming.X_WF.R = Vec3(-1, -1, 1).asDiagonal();
  own.naming.X_WF.p = Vec3(0, 0, 10);
  own.targets = {Vec3(1, 2, 3)};
  start_both({}, own);
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send(start_tracking(100)));
  test::IgtlPeer stream(io, igtl->port());
  ASSERT_TRUE(until_ticked(peer, [&] {
    stream.take();
    return peer.count("TDATA") > 0 && stream.count("POLYDATA") > 0;
  }));
  const auto in_lps = [](const Vec3& p) { return Vec3(-p.x(), -p.y(), p.z() - 10); };
  EXPECT_EQ(stream.last("POINT", "Targets").named_points()[0].second, Vec3(-1, -2, -7));
  EXPECT_EQ(peer.last("TDATA").tools()[0].name, "NeedleToLps");
  simulation.steps(100);  // both rates allow the next
  igtl->publish(simulation.snapshot());
  const NeedleState& needle = simulation.state().needles.states[0];
  const Vec3 tip = in_lps(needle.X_WN.p);
  ASSERT_TRUE(until_read(
      stream, [&] { return (stream.last("TRANSFORM", "NeedleToLps").transform().p - tip).norm() < 1e-4; }));
  const Vec3 f = needle.forces.force_n;
  EXPECT_LT((stream.last("TRANSFORM", "ForceToLps").transform().p - Vec3(-f.x(), -f.y(), f.z())).norm(),
            1e-4);
  const auto& x = simulation.state().mesh.deformed_vertices;
  EXPECT_TRUE(until_read(stream, [&] {
    const std::vector<float> points = stream.last("POLYDATA").points();
    return std::abs(points[3] + x[3]) < 1e-4 && std::abs(points[5] - (x[5] - 10)) < 1e-4;
  }));
}

TEST_F(IgtlContent, WithVersion2TransformsSayThatTheirToolIsSeen) {
  start_igtl(kSilent);
  simulation.steps(5);
  igtl->publish(simulation.snapshot());
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_TRANS", "NeedleToRas"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM") == 1; }));
  EXPECT_EQ(peer.last("TRANSFORM").metadata, "");
  ASSERT_TRUE(peer.send_query("GET_TRANS", "NeedleToRas", 2));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM") == 2; }));
  EXPECT_EQ(peer.last("TRANSFORM").metadata, "TransformStatusOK");
  EXPECT_EQ(peer.last("TRANSFORM").content.size(), kTransformBytes);
}

TEST_F(IgtlContent, TheSurfaceComesFromStartToStop) {
  start_igtl(kSilent);
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("STT_POLYDATA"));
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("POLYDATA") >= 3; }));
  EXPECT_EQ(peer.count("RTS_POLYDATA"), 1u);
  EXPECT_EQ(peer.count("TRANSFORM"), 0u);
  ASSERT_TRUE(peer.send_query("STP_POLYDATA"));
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("RTS_POLYDATA") == 2; }));
  const std::size_t sent = peer.count("POLYDATA");
  ASSERT_TRUE(peer.send_query("GET_STATUS"));
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("STATUS") == 1; }));
  EXPECT_EQ(peer.count("POLYDATA"), sent);
}

TEST_F(IgtlContent, TrackingDataComesAtTheRateAskedForDownToTenMilliseconds) {
  for (const int period_ms : {10, 20, 33, 50, 100}) {
    ServerOptions options;
    options.snapshot_hz = 30;
    start_igtl(kSilent, options);
    test::IgtlPeer peer(io, igtl->port());
    ASSERT_TRUE(peer.send(start_tracking(static_cast<std::uint32_t>(period_ms))));
    ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_TDATA") == 1; }));
    EXPECT_EQ(igtl->wants_ticks(), period_ms <= 33) << "faster than snapshots";
    // Ticks as the daemon's: each of 200 a second while they are wanted, and 30 snapshots a second of older ones.
    constexpr int kTicks = 2000;
    double next_snapshot_s = simulation.state().summary.sim_time_s;
    for (int tick = 0; tick < kTicks; ++tick) {
      const auto older = simulation.snapshot();
      simulation.step();
      const double now_s = simulation.state().summary.sim_time_s;
      if (igtl->wants_ticks()) igtl->track(TrackedTick::of(simulation.state()), clock.utc_ns());
      if (now_s >= next_snapshot_s) {
        next_snapshot_s += 1 / 30.0;
        igtl->publish(older);
      }
      io.restart();
      io.poll();
      peer.take();
    }
    const double expected = kTicks * 5.0 / period_ms;
    EXPECT_NEAR(static_cast<double>(peer.count("TDATA")), expected, std::max(2.0, 0.02 * expected))
        << period_ms;
    EXPECT_EQ(igtl->losses().replaced, 0u);
    igtl.reset();
  }
}

TEST_F(IgtlContent, TrackingDataKeepsItsRateWhereALoadedDaemonLosesTicks) {
  for (const int period_ms : {10, 20, 33, 50}) {
    start_igtl(kSilent);
    publish_both();
    test::IgtlPeer peer(io, igtl->port());
    ASSERT_TRUE(peer.send(start_tracking(static_cast<std::uint32_t>(period_ms))));
    ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_TDATA") == 1; }));
    // Of 25 ticks the daemon loses one, so that simulated time lags by 4 %, and all begin up to 3 ms late.
    constexpr int kPeriods = 2000;
    for (int period = 0; period < kPeriods; ++period) {
      if (period % 25 == 24) continue;
      simulation.step();
      TrackedTick tick = TrackedTick::of(simulation.state());
      tick.time_ns = 5'000'000 * std::int64_t{period + 1} + 1'000'000 * (period * 7 % 4);
      igtl->track(std::move(tick), clock.utc_ns());
      io.restart();
      io.poll();
      peer.take();
    }
    EXPECT_NEAR(static_cast<double>(peer.count("TDATA")), kPeriods * 5.0 / period_ms, 2) << period_ms;
    EXPECT_EQ(igtl->losses().replaced + igtl->losses().missed, 0u) << period_ms;
    igtl.reset();
  }
}

TEST_F(IgtlContent, TrackingDataThatNoTickCouldCarryIsCounted) {
  start_igtl(kSilent);
  publish_both();
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send(start_tracking(20)));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_TDATA") == 1; }));
  for (const std::int64_t time_ms : {1000, 1020, 1040, 1160}) {  // due after: 1060, 1080, …, 1160
    simulation.step();
    TrackedTick tick = TrackedTick::of(simulation.state());
    tick.time_ns = 1'000'000 * time_ms;
    igtl->track(std::move(tick), clock.utc_ns());
    io.restart();
    io.poll();
    peer.take();
  }
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TDATA") == 4; }));
  EXPECT_EQ(igtl->losses().missed, 4u);
  ASSERT_TRUE(peer.send_query("STP_TDATA", "TDataClient"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_TDATA") == 2; }));
  EXPECT_EQ(igtl->losses().missed, 4u) << "and stays counted";
}

TEST_F(IgtlContent, CommandsAreCarriedOutWhereTheSceneAllowsThem) {
  IgtlOptions own;
  own.first_message_wait = kSilent;
  std::vector<std::string> done;
  own.takes_commands = true;
  start_both({}, own);
  ASSERT_TRUE(server->hold_lease(0, "script"));
  RequestHandlers& requests = server->requests();
  requests.set<ControlMessage>([&](const ControlMessage& message, const Sender&) {
    done.push_back("control " + std::to_string(static_cast<int>(message.action)));
    return message.action == ControlAction::kPlay ? "there is no script" : "";
  });
  requests.set<ArmMessage>(
      [&](const ArmMessage&, const Sender& from) { done.push_back("arm for " + from.name.substr(0, 11)); });
  requests.set<DropMessage>(
      [&](const DropMessage& drop, const Sender&) { done.push_back(drop.pressed ? "press" : "release"); });
  simulation.steps(5);
  igtl->publish(simulation.snapshot());
  test::IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_STATUS"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") == 1; }));
  for (const char* words : {"reset", "arm", "drop", "dance"}) ASSERT_TRUE(peer.send(text(words)));
  ASSERT_TRUE(peer.send(command("play")));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_COMMAND") == 1; }));
  EXPECT_EQ(done,
            (std::vector<std::string>{"control 3", "arm for OpenIGTLink", "press", "release", "control 1"}));
  EXPECT_EQ(peer.count("STATUS"), 5u);
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kIllegalInstruction) << "dance";
  const auto answer = std::span<const std::byte>(peer.last("RTS_COMMAND").content);
  EXPECT_EQ(get<std::uint32_t>(answer), 42u);
  EXPECT_EQ(get_name(answer.subspan(4, 128)), "there is no script");
}

// A model takes its time to prepare, and may be refused then: over the native protocol with CONTROL_REFUSED.
TEST_F(IgtlContent, ACommandIsAnsweredWhenItsOutcomeIsKnown) {
  IgtlOptions own;
  own.first_message_wait = kSilent;
  own.takes_commands = true;
  start_both({}, own);
  std::function<void(std::string)> kept;
  server->requests().set<ControlMessage>(
      [&](const ControlMessage&, const Sender& from) { kept = from.refuse; });
  test::IgtlPeer peer(io, igtl->port());
  for (const char* refusal : {"the needle bends, and psi31 knows no forces", ""}) {
    const std::size_t before = peer.count("RTS_COMMAND"), statuses = peer.count("STATUS");
    ASSERT_TRUE(peer.send(command("model psi31")));
    ASSERT_TRUE(until_read(peer, [&] { return kept != nullptr; }));
    ASSERT_TRUE(peer.send_query("GET_STATUS"));
    ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") == statuses + 1; }));
    EXPECT_EQ(peer.count("RTS_COMMAND"), before) << "it is not known yet";
    if (*refusal) kept(refusal);
    kept = nullptr;
    ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_COMMAND") == before + 1; }));
    const auto answer = std::span<const std::byte>(peer.last("RTS_COMMAND").content);
    EXPECT_EQ(get_name(answer.subspan(4, 128)), refusal);
  }
}

TEST_F(IgtlContent, WhatIsNotTakenIsCountedAndTold) {
  start_igtl(kSilent);
  {
    test::IgtlPeer peer(io, igtl->port());
    ASSERT_TRUE(peer.send(text("reset")));  // commands are off
    ASSERT_TRUE(peer.send(encode_empty("SENSOR", {1, "Arm", 0})));
    ASSERT_TRUE(peer.send(command("reset")));
    ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_COMMAND") == 1; }));
    for (int i = 0; i < 200; ++i) ASSERT_TRUE(peer.send_query("GET_STATUS"));
    ASSERT_TRUE(until_read(peer, [&] { return igtl->losses().ignored > 0; }));
    EXPECT_EQ(igtl->losses().skipped, 3u);
    peer.close();
  }
  ASSERT_TRUE(until([&] { return has_logged("3 messages of other types skipped, "); }));
  EXPECT_TRUE(has_logged("queries over the limit ignored"));
  EXPECT_EQ(igtl->losses().skipped, 3u) << "also of clients that have left";
}

}  // namespace
}  // namespace brachy::net::igtl
