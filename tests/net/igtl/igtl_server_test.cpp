#include <gtest/gtest.h>

#include <algorithm>

#include "tests/net/igtl/igtl_fixture.h"

namespace brachy::net::igtl {
namespace {

using namespace test;

constexpr std::chrono::milliseconds kLong{60'000};  // a silent client may still send a query

struct IgtlServerTest : IgtlFixture {};

TEST_F(IgtlServerTest, WhoSaysNothingGetsSurfaceNeedleAndForce) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(until_ticked(
      peer, [&] { return peer.count("POLYDATA") > 0 && peer.count("TRANSFORM", "ForceToRas") > 0; }));
  EXPECT_EQ(peer.last("POLYDATA").header.device, "gland");
  EXPECT_EQ(peer.last("POLYDATA").points().size(), 3 * tissue.surface_count);
  const RigidTransform needle = peer.last("TRANSFORM", "NeedleToRas").transform();
  EXPECT_EQ(needle.R, Mat3::Identity());
  EXPECT_GT(needle.p.x(), 0);
  const RigidTransform force = peer.last("TRANSFORM", "ForceToRas").transform();
  EXPECT_EQ(force.R, Mat3::Identity());
  EXPECT_EQ(force.p, Vec3(0, 1, 0));
  for (const Received& r : peer.received) EXPECT_EQ(r.header.version, 1);
}

TEST_F(IgtlServerTest, PointsAreTheSnapshotsBitForBit) {
  start_igtl();
  simulation.steps(50);
  igtl->publish(simulation.snapshot());
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("POLYDATA") > 0 && peer.count("TRANSFORM") > 0; }));
  const auto& all = simulation.state().mesh.deformed_vertices;
  const std::vector<float> surface(all.begin(),
                                   all.begin() + static_cast<std::ptrdiff_t>(3 * tissue.surface_count));
  EXPECT_EQ(peer.last("POLYDATA").points(), surface);
  EXPECT_EQ(peer.last("TRANSFORM", "NeedleToRas").transform().p.x(), 50);
}

TEST_F(IgtlServerTest, ABentNeedlesTipIsATransformOfItsOwn) {
  start_igtl();
  simulation.steps(50);
  NeedleState& needle = simulation.state().needles.states[0];
  needle.X_WN.R = Eigen::AngleAxisd(0.5, Vec3::UnitZ()).toRotationMatrix();
  needle.shape.is_bent = true;
  needle.shape.points.back() = Vec3(1, 2, 3);
  needle.shape.tip_axis = Vec3(0, 0.6, 0.8);
  needle.shape.tip_deflection = Vec3(0, 2, 0);
  igtl->publish(simulation.snapshot());
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM", "BentTipToRas") > 0; }));
  const RigidTransform tip = peer.last("TRANSFORM", "BentTipToRas").transform();
  EXPECT_EQ(tip.p, Vec3(1, 2, 3));
  EXPECT_LT((tip.R.col(2) - Vec3(0, 0.6, 0.8)).norm(), 1e-6);
  EXPECT_LT(rigidity_error(tip), 1e-6);
  const Mat3 turn = tip.R * needle.X_WN.R.transpose();
  EXPECT_NEAR(Eigen::AngleAxisd(turn).angle(), std::acos(0.8), 1e-6) << "no further than the axis";
  EXPECT_EQ(peer.last("TRANSFORM", "NeedleToRas").transform().p.x(), 50) << "the pose stays";
}

TEST_F(IgtlServerTest, ARigidNeedleHasNoBentTip) {
  start_igtl(kLong);
  simulation.steps(5);
  igtl->publish(simulation.snapshot());
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_TRANS", "BentTipToRas"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM") == 1; }));
  EXPECT_TRUE(peer.last("TRANSFORM").content.empty());
  NeedleState& needle = simulation.state().needles.states[0];
  needle.shape.is_bent = true;
  needle.shape.points.back() = Vec3(1, 2, 3);
  igtl->publish(simulation.snapshot());
  ASSERT_TRUE(peer.send_query("GET_TRANS", "BentTipToRas"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM", "BentTipToRas") == 2; }));
  EXPECT_EQ(peer.last("TRANSFORM", "BentTipToRas").transform().p, Vec3(1, 2, 3));
}

TEST_F(IgtlServerTest, RatesAreCapped) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("POLYDATA") > 0; }));
  peer.received.clear();
  const std::uint64_t first = simulation.state().summary.tick;
  ASSERT_TRUE(
      until_ticked(peer, [&] { return simulation.state().summary.tick == first + 400; }));  // 2 s at 200 Hz
  EXPECT_NEAR(static_cast<double>(peer.count("POLYDATA")), 20, 2);
  EXPECT_NEAR(static_cast<double>(peer.count("TRANSFORM", "NeedleToRas")), 60, 2);
}

TEST_F(IgtlServerTest, ATransformOfANeedleIsItsPose) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  RigidTransform X = at(1, 2, 3);
  X.R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  ASSERT_TRUE(peer.send_pose("NeedleToRas", X));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1; }));
  EXPECT_EQ(poses[0].X_WN.R, X.R);
  EXPECT_EQ(poses[0].X_WN.p, X.p);
  EXPECT_EQ(poses[0].sequence, 1u);
  EXPECT_NEAR(static_cast<double>(poses[0].stamp_ns - 1'700'000'000'005'000'000), 0, 2);
  EXPECT_GT(poses[0].received_ns, 0);
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_FALSE(last_device.takes_force);
  EXPECT_NE(server->lease_holder(0).find("NeedleToRas (OpenIGTLink 127.0.0.1:"), std::string::npos);
}

TEST_F(IgtlServerTest, WithoutATimestampThePoseIsOfWhenItCame) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send(encode_transform({1, "NeedleToRas", 0}, at(1, 2, 3))));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1; }));
  EXPECT_EQ(poses[0].stamp_ns, poses[0].received_ns);
}

TEST_F(IgtlServerTest, OtherToolsAreNoPoses) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  for (const char* tool : {"Tracker", "StylusToReference", "ForceToRas"})
    ASSERT_TRUE(peer.send_pose(tool, at(1, 2, 3)));
  ASSERT_TRUE(peer.send_query("GET_STATUS"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") > 0; }));
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kOk);
  EXPECT_TRUE(poses.empty());
  EXPECT_EQ(server->lease_holder(0), "");
}

TEST_F(IgtlServerTest, TransformsOfOtherNamesAreCountedAndLoggedOnceEach) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  for (const char* tool : {"StylusToReference", "StylusToReference", "ProbeToTracker"})
    ASSERT_TRUE(peer.send_pose(tool, at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return igtl->other_names() == 3; }));
  const auto lines = std::count_if(log.begin(), log.end(), [](const std::string& line) {
    return line.find("moves no needle and is skipped") != std::string::npos;
  });
  EXPECT_EQ(lines, 2);
}

TEST_F(IgtlServerTest, ItsOwnPoseIsNotSentBackButItsForceIs) {
  start_igtl();
  IgtlPeer sender(io, igtl->port()), viewer(io, igtl->port());
  ASSERT_TRUE(sender.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(viewer, [&] { return poses.size() == 1; }));
  ASSERT_TRUE(until_ticked(viewer, [&] {
    sender.take();
    return viewer.count("TRANSFORM", "NeedleToRas") > 3 && sender.count("TRANSFORM", "ForceToRas") > 3;
  }));
  EXPECT_EQ(sender.count("TRANSFORM", "NeedleToRas"), 0u);
}

TEST_F(IgtlServerTest, EachNeedleHasItsOwnName) {
  simulation = net::test::FakeSimulation(tissue, 1, 3);
  ServerOptions options;
  options.needles = 3;
  start_igtl(std::chrono::milliseconds(0), options);
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_pose("Needle1ToRas", at(1, 2, 3)));
  ASSERT_TRUE(peer.send_pose("Needle2ToRas", at(4, 5, 6)));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 2; }));
  EXPECT_EQ(pose_needles, (std::vector<std::uint16_t>{1, 2}));
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("TRANSFORM", "Force2ToRas") > 1; }));
  EXPECT_EQ(peer.last("TRANSFORM", "Force2ToRas").transform().p, Vec3(0, 1, -2));
  EXPECT_GT(peer.count("TRANSFORM", "Needle0ToRas"), 0u);
  EXPECT_EQ(peer.count("TRANSFORM", "Needle1ToRas"), 0u);
  ASSERT_TRUE(peer.send_pose("Needle3ToRas", at(4, 5, 6)));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") == 1; }));
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kNotPresent);
  EXPECT_EQ(peer.last("STATUS").status().text, "there is no needle 3: needles are 0 to 2");
}

TEST_F(IgtlServerTest, ATakenNeedleIsRefusedWithItsHoldersName) {
  start_igtl();
  const auto native = join_as(Role::kDevice, "touch");
  IgtlPeer peer(io, igtl->port());
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") > 0; }));
  const Status status = peer.last("STATUS").status();
  EXPECT_EQ(status.code, StatusCode::kBusy);
  EXPECT_NE(status.text.find("touch (127.0.0.1:"), std::string::npos) << status.text;
  ASSERT_TRUE(peer.send_query("GET_CAPABIL"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("CAPABILITY") == 1; }));
  EXPECT_LE(peer.count("STATUS"), 4u) << "a few a second";
  EXPECT_TRUE(poses.empty());

  native->client.close();
  ASSERT_TRUE(until([&] { return server->lease_holder(0).empty(); }));
  ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1; }));
}

TEST_F(IgtlServerTest, ANativeDeviceIsRefusedWhileItHoldsTheNeedle) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1; }));
  const auto native = join_as(Role::kDevice, "touch");
  ASSERT_FALSE(native->errors.empty());
  EXPECT_EQ(native->errors[0].code, ErrorCode::kDeviceBusy);
  EXPECT_NE(native->errors[0].text.find("NeedleToRas (OpenIGTLink"), std::string::npos);
}

TEST_F(IgtlServerTest, TheNeedleIsFreeOnceTheClientIsGone) {
  start_igtl();
  const auto viewer = join_as(Role::kViewer, "viewer");
  {
    IgtlPeer peer(io, igtl->port());
    ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
    ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1; }));
  }
  ASSERT_TRUE(until([&] { return server->lease_holder(0).empty() && viewer->events.size() == 2; }));
  EXPECT_EQ(devices,
            (std::vector<std::pair<bool, std::string>>{{true, "NeedleToRas"}, {false, "NeedleToRas"}}));
  EXPECT_EQ(viewer->events[0].kind, EventKind::kDeviceAttached);
  EXPECT_EQ(viewer->events[1].kind, EventKind::kDeviceDetached);
}

TEST_F(IgtlServerTest, TheNeedleIsFreeOnceTheClientSendsNoPoseAnyMore) {
  ServerOptions options;
  options.ping_interval = std::chrono::milliseconds(100);
  options.silence_timeout = std::chrono::milliseconds(300);
  start_igtl(std::chrono::milliseconds(0), options);
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1; }));
  pass(std::chrono::milliseconds(200));
  EXPECT_FALSE(server->lease_holder(0).empty());
  pass(std::chrono::milliseconds(150));
  EXPECT_TRUE(server->lease_holder(0).empty());
  ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 2; }));
  EXPECT_FALSE(peer.is_ended());
}

TEST_F(IgtlServerTest, RefusedPosesAreToldWithTheGuardsCode) {
  start_igtl();
  verdict = {false, 2, "not rigid"};
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") == 1; }));
  const Status status = peer.last("STATUS").status();
  EXPECT_EQ(status.sub_code, 2);
  EXPECT_EQ(status.text, "not rigid");
  const auto viewer = join_as(Role::kViewer, "viewer");
  ASSERT_TRUE(until([&] { return !viewer->states.empty(); }));
  ASSERT_EQ(viewer->states.back().refusals.size(), 1u);
  EXPECT_EQ(viewer->states.back().refusals[0].code, 2);
}

TEST_F(IgtlServerTest, AFloodOfPosesIsCutToTheRate) {
  ServerOptions options;
  options.max_poses_per_s = 100;
  start_igtl(std::chrono::milliseconds(0), options);
  IgtlPeer peer(io, igtl->port());
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") > 0; }));
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kOverflow);
  EXPECT_LT(poses.size(), 250u);
}

TEST_F(IgtlServerTest, ATrackerThatDoesNotSeeTheNeedleMovesNothing) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  Bytes message = encode_transform({2, "NeedleToRas", 1}, at(0, 0, 0));
  // What PLUS adds: one metadata of ASCII text.
  const std::string text = "TransformStatusINVALID";
  message.resize(message.size() - 2);
  const auto add = [&](std::initializer_list<int> bytes) {
    for (const int b : bytes) message.push_back(static_cast<std::byte>(b));
  };
  add({0, 1, 0, 15, 0, 3, 0, 0, 0, 7});
  for (const char c : text) message.push_back(static_cast<std::byte>(c));
  message[58 + 3] = std::byte{10};
  message[58 + 7] = static_cast<std::byte>(text.size());
  ASSERT_TRUE(peer.send(with_right_size_and_crc(message)));
  ASSERT_TRUE(peer.send_query("GET_STATUS", "", 2));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") == 1; }));
  EXPECT_EQ(server->lease_holder(0), "") << "a tool that is not seen takes no needle";
  ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3), 2));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1; }));
  EXPECT_EQ(poses[0].X_WN.p, Vec3(1, 2, 3));
}

TEST_F(IgtlServerTest, Version2IsAnsweredToWhoSendsItAndToNobodyElse) {
  start_igtl(kLong);
  IgtlPeer one(io, igtl->port()), two(io, igtl->port());
  ASSERT_TRUE(one.send_query("GET_STATUS"));
  ASSERT_TRUE(two.send_query("GET_STATUS", "", 2));
  ASSERT_TRUE(one.send_query("STRING"));
  ASSERT_TRUE(two.send_query("STRING"));  // version 1 again: once is enough
  ASSERT_TRUE(until_ticked(one, [&] {
    two.take();
    return one.count("POLYDATA") > 1 && two.count("POLYDATA") > 1;
  }));
  for (const Received& r : one.received) EXPECT_EQ(r.header.version, 1) << r.header.type;
  for (const Received& r : two.received) EXPECT_EQ(r.header.version, 2) << r.header.type;
  EXPECT_EQ(one.last("POLYDATA").points().size(), two.last("POLYDATA").points().size());
}

TEST_F(IgtlServerTest, WhoAsksGetsAnswersAndNothingElse) {
  start_igtl(kLong);
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_POLYDATA", "Client"));
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("POLYDATA") == 1; }));
  for (int i = 0; i < 100; ++i) publish_both();
  ASSERT_TRUE(peer.send_query("GET_TRANS"));
  ASSERT_TRUE(peer.send_query("GET_TRANS", "ForceToRas"));
  ASSERT_TRUE(peer.send_query("GET_TRANS", "Nothing"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM") == 3; }));
  ASSERT_EQ(peer.received.size(), 4u);
  EXPECT_EQ(peer.received[1].header.device, "NeedleToRas");
  EXPECT_EQ(peer.received[2].transform().p, Vec3(0, 1, 0));
  EXPECT_EQ(peer.received[3].header.device, "Nothing");
  EXPECT_TRUE(peer.received[3].content.empty());
}

TEST_F(IgtlServerTest, AQueryBeforeTheFirstSnapshotIsAnsweredWithIt) {
  start_igtl(kLong);
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_TRANS"));
  ASSERT_TRUE(peer.send_query("GET_POLYDATA"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM") == 1; }));
  EXPECT_TRUE(peer.last("TRANSFORM").content.empty());
  publish_both();
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("POLYDATA") == 1; }));
}

TEST_F(IgtlServerTest, TrackingDataComesFromStartToStopAtTheRateAskedFor) {
  start_igtl(kLong);
  IgtlPeer peer(io, igtl->port());
  Bytes start = encode_empty("STT_TDATA", {1, "TDataClient", 0});
  for (const int byte : {0, 0, 0, 100}) start.push_back(static_cast<std::byte>(byte));
  start.resize(start.size() + 32);
  ASSERT_TRUE(peer.send(with_right_size_and_crc(start)));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_TDATA", "TDataClient") == 1; }));
  EXPECT_EQ(peer.last("RTS_TDATA").content, Bytes(1));
  const std::uint64_t first = simulation.state().summary.tick;
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("TDATA") == 10; }));
  EXPECT_GE(simulation.state().summary.tick - first, 9u * 20);
  const auto tools = peer.last("TDATA").tools();
  ASSERT_EQ(tools.size(), 1u);
  EXPECT_EQ(tools[0].name, "NeedleToRas");
  EXPECT_GT(tools[0].X.p.x(), 1);
  ASSERT_TRUE(peer.send_query("STP_TDATA", "TDataClient"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_TDATA") == 2; }));
  const std::size_t before = peer.received.size();
  for (int i = 0; i < 100; ++i) publish_both();
  ASSERT_TRUE(peer.send_query("GET_STATUS"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") == 1; }));
  EXPECT_EQ(peer.received.size(), before + 1);
}

TEST_F(IgtlServerTest, TrackingDataKeepsTheMeanOfAnyRateAskedFor) {
  for (const int period_ms : {33, 40, 50, 70, 100, 330}) {
    ServerOptions options;
    options.snapshot_hz = 30;
    start_igtl(kLong, options);
    IgtlPeer peer(io, igtl->port());
    Bytes start = encode_empty("STT_TDATA", {1, "TDataClient", 0});
    for (const int byte : {0, 0, period_ms >> 8, period_ms & 255})
      start.push_back(static_cast<std::byte>(byte));
    start.resize(start.size() + 32);
    ASSERT_TRUE(peer.send(with_right_size_and_crc(start)));
    ASSERT_TRUE(until_read(peer, [&] { return peer.count("RTS_TDATA") == 1; }));
    // Snapshots as the daemon's: 30 a second, each of the newest of 200 ticks a second.
    const double begin_s = simulation.state().summary.sim_time_s;
    for (int snapshot = 1; snapshot <= 330; ++snapshot) {
      while (simulation.state().summary.sim_time_s < begin_s + snapshot / 30.0 - 0.005) simulation.step();
      igtl->publish(simulation.snapshot());
      for (int i = 0; i < 5; ++i) {
        io.restart();
        io.poll();
        peer.take();
      }
    }
    const double expected = 11'000.0 / std::max(period_ms, 33);
    EXPECT_NEAR(static_cast<double>(peer.count("TDATA")), expected, std::max(2.0, 0.02 * expected))
        << period_ms;
    igtl.reset();
  }
}

TEST_F(IgtlServerTest, WithVersion2AMissingTransformIsAStatusThatUpstreamUnpacks) {
  start_igtl(kLong);
  simulation.steps(5);
  igtl->publish(simulation.snapshot());
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_TRANS", "Nothing", 2));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") == 1; }));
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kNotPresent);
  EXPECT_EQ(peer.last("STATUS").header.device, "Nothing");
  ASSERT_TRUE(peer.send_query("GET_TRANS", "NeedleToRas", 3));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("TRANSFORM", "NeedleToRas") == 1; }));
  EXPECT_EQ(peer.last("TRANSFORM").header.version, 2);
}

TEST_F(IgtlServerTest, CapabilityNamesWhatIsUnderstood) {
  start_igtl(kLong);
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_CAPABIL", "Device"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("CAPABILITY") == 1; }));
  EXPECT_EQ(peer.last("CAPABILITY").content.size() % 12, 0u);
  EXPECT_EQ(peer.last("CAPABILITY").content[0], std::byte{'T'});
}

TEST_F(IgtlServerTest, ASurfaceIsEncodedOnceForAll) {
  start_igtl();
  publish_both();
  std::vector<std::unique_ptr<IgtlPeer>> peers;
  for (int i = 0; i < 10; ++i) {
    peers.push_back(std::make_unique<IgtlPeer>(io, igtl->port()));
    const std::uint16_t version = i % 2 == 0 ? 1 : 2;
    ASSERT_TRUE(peers.back()->send_query("STRING", "", version));
  }
  ASSERT_TRUE(until([&] {
    return std::all_of(peers.begin(), peers.end(), [](auto& peer) {
      peer->take();
      return peer->count("POLYDATA") == 1;
    });
  }));
  EXPECT_EQ(igtl->surfaces_encoded(), 2u) << "one for each header version";
}

TEST_F(IgtlServerTest, OneClientTooManyIsToldSo) {
  ServerOptions options;
  options.max_clients = 1;
  start_igtl(kLong, options);
  IgtlPeer first(io, igtl->port());
  ASSERT_TRUE(until([&] { return igtl->client_count() == 1; }));
  IgtlPeer second(io, igtl->port());
  ASSERT_TRUE(until_read(second, [&] { return second.is_ended(); }));
  EXPECT_EQ(second.last("STATUS").status().code, StatusCode::kBusy);
  first.take();
  EXPECT_FALSE(first.is_ended());
}

TEST_F(IgtlServerTest, EndsWithAStatusForEverybody) {
  start_igtl(kLong);
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(until([&] { return igtl->client_count() == 1; }));
  igtl->stop();
  ASSERT_TRUE(until_read(peer, [&] { return peer.is_ended(); }));
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kShutdown);
  peer.close();
  server->stop();
  EXPECT_TRUE(until([&] { return io.stopped(); }));
}

TEST_F(IgtlServerTest, APortInUseIsToldWithItsOption) {
  start_igtl();
  try {
    IgtlServer second(io, IgtlOptions{igtl->port()}, *server, tissue, [](const std::string&) {});
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("--igtl-port"), std::string::npos) << error.what();
  }
}

TEST_F(IgtlServerTest, ASimulationThatBeginsAnewGoesOn) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(until_ticked(
      peer, [&] { return simulation.state().summary.tick > 500 && peer.count("POLYDATA") > 3; }));
  simulation = net::test::FakeSimulation(tissue);
  peer.received.clear();
  ASSERT_TRUE(until_ticked(peer, [&] { return peer.count("POLYDATA") > 1 && peer.count("TRANSFORM") > 1; }));
  EXPECT_LT(simulation.state().summary.tick, 200u);
}

}  // namespace
}  // namespace brachy::net::igtl
