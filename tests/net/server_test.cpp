// Well-behaved clients: the messages that they receive, and when.
#include "net/server/server.h"

#include <algorithm>
#include <thread>

#include "core/base/version.h"
#include "tests/net/net_testing.h"
#include "tests/net/raw_peer.h"

namespace brachy::net::test {
namespace {

struct ServerTest : ServerFixture {};

TEST_F(ServerTest, GreetsWithWelcomeTopologyAndAFullFrame) {
  ServerOptions options;
  options.topology_name = "phantom";
  start(options);
  const auto viewer = join();
  ASSERT_TRUE(until([&] { return viewer->topologies == 1; }));
  EXPECT_EQ(viewer->welcome.units, "mm,s,N");
  EXPECT_EQ(viewer->welcome.frame, "RAS");
  EXPECT_EQ(viewer->welcome.deformation_hz, 200);
  EXPECT_EQ(viewer->welcome.max_poses_per_s, 2000u);
  EXPECT_EQ(viewer->welcome.topology_hash, server->topology_hash());
  EXPECT_EQ(viewer->topology.name, "phantom");
  EXPECT_EQ(viewer->topology.surface_vertex_count, tissue.surface_count);
  EXPECT_EQ(viewer->topology.triangles, tissue.triangles);
  publish();
  ASSERT_TRUE(until([&] { return viewer->frames.size() == 1; }));
  EXPECT_TRUE(viewer->frames[0].full);
  EXPECT_EQ(viewer->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
}

TEST_F(ServerTest, BothSidesAreToldWhatSoftwareTheOtherIs) {
  ServerOptions options;
  options.server_name = "brachyd 7.1";
  start(options);
  const auto viewer = join();
  ASSERT_TRUE(until([&] { return viewer->topologies == 1; }));
  EXPECT_EQ(viewer->welcome.server, "brachyd 7.1");
  EXPECT_TRUE(std::ranges::any_of(log, [](const std::string& line) {
    return line.find(" (brachy " + version() + ") from ") != std::string::npos;
  }));
}

TEST_F(ServerTest, ALateJoinerGetsTheFullStateAtOnceAndBothSeeTheSame) {
  start();
  const auto early = join();
  for (int i = 0; i < 10; ++i) {
    publish();
    ASSERT_TRUE(until([&] { return early->frames.size() == static_cast<std::size_t>(i) + 1; }));
    ASSERT_EQ(early->frames.back().full, i == 0);
    ASSERT_EQ(early->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
  }
  const auto late = join();
  ASSERT_TRUE(until([&] { return late->frames.size() == 1; }));
  EXPECT_TRUE(late->frames[0].full);
  EXPECT_EQ(late->frames[0].tick, 10u);
  EXPECT_EQ(late->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
  publish();
  ASSERT_TRUE(until([&] { return late->frames.size() == 2 && early->frames.size() == 11; }));
  EXPECT_FALSE(late->frames[1].full);
  EXPECT_EQ(late->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
  EXPECT_EQ(early->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
  EXPECT_EQ(early->client.snapshots_missed(), 0u);
}

TEST_F(ServerTest, SubscriptionsAreGrantedAndKept) {
  start();
  ClientOptions options;
  options.subscription = kSubscribeFullFrames | kSubscribePoseHistory | 1u << 31;  // of a later version
  const auto full = join(options);
  options.subscription = kSubscribeNoMesh;
  const auto bare = join(options);
  ASSERT_TRUE(until([&] { return full->topologies == 1 && bare->welcomes == 1; }));
  EXPECT_EQ(full->welcome.subscription, kSubscribeFullFrames | kSubscribePoseHistory);
  for (std::size_t i = 1; i <= 3; ++i) {
    simulation.steps(6);  // several ticks a snapshot
    publish();
    ASSERT_TRUE(until([&] { return full->frames.size() == i; }));
    EXPECT_TRUE(full->frames.back().full);
    EXPECT_EQ(full->frames.back().pose_history.size(), 7u);
  }
  ASSERT_TRUE(until([&] { return !bare->states.empty(); }));
  EXPECT_EQ(bare->topologies, 0);
  EXPECT_TRUE(bare->frames.empty());
}

TEST_F(ServerTest, ASimulationThatBeginsAnewSendsFullFrames) {
  start();
  const auto viewer = join();
  simulation.steps(20);
  publish();
  ASSERT_TRUE(until([&] { return viewer->frames.size() == 1; }));
  simulation = FakeSimulation(tissue, 5);
  publish();
  ASSERT_TRUE(until([&] { return viewer->frames.size() == 2; }));
  EXPECT_TRUE(viewer->frames[1].full);
  EXPECT_EQ(viewer->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
}

TEST_F(ServerTest, PosesReachTheSimulationWithTheirSequenceAndStamp) {
  start();
  const auto device = join_as(Role::kDevice, "touch");
  RigidTransform X_WN;
  X_WN.p = {1, 2, 3};
  device->client.send_pose(X_WN, 4711);
  ASSERT_TRUE(until([&] { return poses.size() == 1; }));
  EXPECT_TRUE(poses[0].present);
  EXPECT_EQ(poses[0].X_WN, X_WN);
  EXPECT_EQ(poses[0].stamp_ns, 4711);
  EXPECT_GT(poses[0].sequence, 1u);
  EXPECT_GT(poses[0].received_ns, 0);
}

TEST_F(ServerTest, ASecondDeviceIsToldWhoHoldsTheLeaseUntilItIsReleased) {
  start();
  auto first = join_as(Role::kDevice, "touch");
  EXPECT_EQ(devices, (std::vector<std::pair<bool, std::string>>{{true, "touch"}}));
  const auto second = join_as(Role::kDevice, "falcon");
  ASSERT_TRUE(until([&] { return !second->closed.empty(); }));
  ASSERT_EQ(second->errors.size(), 1u);
  EXPECT_EQ(second->errors[0].code, ErrorCode::kDeviceBusy);
  EXPECT_NE(second->errors[0].text.find("touch (127.0.0.1:"), std::string::npos) << second->errors[0].text;
  EXPECT_NE(second->errors[0].text.find(" for 0 s"), std::string::npos) << second->errors[0].text;
  EXPECT_FALSE(server->hold_lease(0, "scripted device"));
  first.reset();
  ASSERT_TRUE(until([&] { return devices.size() == 2; }));
  EXPECT_FALSE(devices[1].first);
  EXPECT_EQ(server->lease_holder(0), "");
  const auto third = join_as(Role::kDevice, "falcon");
  EXPECT_EQ(third->welcomes, 1);
}

TEST_F(ServerTest, TheScriptedDeviceHoldsTheLeaseToo) {
  start();
  ASSERT_TRUE(server->hold_lease(0, "scripted device insertion.csv"));
  const auto device = join_as(Role::kDevice, "touch");
  ASSERT_TRUE(until([&] { return !device->closed.empty(); }));
  EXPECT_EQ(device->errors[0].code, ErrorCode::kDeviceBusy);
  EXPECT_NE(device->closed[0].find("scripted device insertion.csv"), std::string::npos);
  server->release_lease(0);
  EXPECT_EQ(join_as(Role::kDevice, "touch")->welcomes, 1);
}

TEST_F(ServerTest, RefusedPosesAreReportedToTheSenderAndCounted) {
  start();
  const auto device = join_as(Role::kDevice, "touch");
  verdict = {false, 3, "the rotation is not rigid"};
  for (int i = 0; i < 20; ++i) device->client.send_pose({}, i + 1);
  ASSERT_TRUE(until([&] { return poses.size() == 20 && !device->errors.empty(); }));
  verdict = {};
  device->client.send_pose({}, 21);
  ASSERT_TRUE(until([&] { return poses.size() == 21; }));
  device->states.clear();
  device->client.request_state();
  ASSERT_TRUE(until([&] { return !device->states.empty(); }));
  const StateMessage& state = device->states.back();
  EXPECT_EQ(state.ticks, 1234u);
  EXPECT_EQ(state.poses_accepted, 1u);
  ASSERT_EQ(state.refusals.size(), 1u);
  EXPECT_EQ(state.refusals[0].code, 3);
  EXPECT_EQ(state.refusals[0].count, 20u);
  EXPECT_EQ(state.device_holder, server->lease_holder(0));
  EXPECT_GE(device->errors.size(), 1u);
  EXPECT_LE(device->errors.size(), 8u);  // rate-limited
  EXPECT_EQ(device->errors[0].code, ErrorCode::kPoseRefused);
  EXPECT_EQ(device->errors[0].reason, 3);
  EXPECT_FALSE(device->errors[0].fatal);
  EXPECT_EQ(device->errors[0].about_sequence, poses[0].sequence);
}

TEST_F(ServerTest, MorePosesThanAllowedAreRefusedAndTheSenderToldOnce) {
  ServerOptions options;
  options.max_poses_per_s = 100;  // bursts of 10
  start(options);
  ClientOptions device_options;
  device_options.role = Role::kDevice;
  device_options.max_queued_poses = 1000;
  const auto device = join(device_options);
  for (int i = 0; i < 500; ++i) device->client.send_pose({}, i + 1);
  const auto refused = [&] {
    return device->states.empty() || device->states.back().refusals.empty()
               ? 0
               : device->states.back().refusals[0].count;
  };
  ASSERT_TRUE(until([&] { return poses.size() + refused() == 500; }));
  EXPECT_GE(poses.size(), 10u);
  EXPECT_LT(poses.size(), 400u);
  EXPECT_EQ(device->states.back().refusals[0].code, kRefusedRate);
  EXPECT_EQ(device->states.back().poses_accepted, poses.size());
  ASSERT_FALSE(device->errors.empty());
  EXPECT_LE(device->errors.size(), 3u);
  EXPECT_EQ(device->errors[0].code, ErrorCode::kPoseRate);
}

TEST_F(ServerTest, AViewerMaySendNoPoses) {
  start();
  const auto viewer = join_as(Role::kViewer, "watch");
  viewer->client.send_pose({}, 1);
  ASSERT_TRUE(until([&] { return !viewer->errors.empty(); }));
  EXPECT_EQ(viewer->errors[0].code, ErrorCode::kNotDevice);
  EXPECT_FALSE(viewer->errors[0].fatal);
  EXPECT_TRUE(poses.empty());
}

TEST_F(ServerTest, EventsReachEveryClient) {
  start();
  const auto one = join_as(Role::kViewer, "one");
  const auto two = join_as(Role::kOperator, "two");
  server->broadcast({EventKind::kPuncture, 0, 12, "capsule punctured"});
  ASSERT_TRUE(until([&] { return one->events.size() == 1 && two->events.size() == 1; }));
  EXPECT_EQ(one->events[0].tick, 12u);
  EXPECT_EQ(one->events[0].text, "capsule punctured");
  const auto device = join_as(Role::kDevice, "touch");
  ASSERT_TRUE(until([&] { return one->events.size() == 2; }));
  EXPECT_EQ(one->events[1].kind, EventKind::kDeviceAttached);
}

TEST_F(ServerTest, StatesCountClientsAndSnapshots) {
  start();
  const auto viewer = join_as(Role::kViewer, "watch");
  const auto device = join_as(Role::kDevice, "touch");
  publish();
  ASSERT_TRUE(until([&] { return viewer->frames.size() == 1; }));
  viewer->states.clear();
  ASSERT_TRUE(until([&] { return !viewer->states.empty(); }));  // unasked, twice a second
  EXPECT_EQ(viewer->states[0].clients, 2u);
  EXPECT_EQ(viewer->states[0].viewers, 1u);
  EXPECT_EQ(viewer->states[0].snapshots, 1u);
  EXPECT_EQ(viewer->states[0].snapshots_sent, 1u);
  EXPECT_EQ(viewer->states[0].snapshots_dropped, 0u);
}

TEST_F(ServerTest, StopTellsEveryClientAndLeavesNothingToDo) {
  start();
  const auto viewer = join_as(Role::kViewer, "watch");
  const std::int64_t begin_ns = clock.now_ns();
  server->stop();
  server->publish(simulation.snapshot());
  ASSERT_TRUE(until([&] { return !viewer->closed.empty(); }));
  EXPECT_EQ(viewer->errors[0].code, ErrorCode::kShutdown);
  io.restart();
  EXPECT_TRUE(until([&] { return io.stopped(); }));
  EXPECT_LT(clock.now_ns() - begin_ns, in_ns(std::chrono::seconds(2)));
  EXPECT_THROW(join(), UserError);  // the listener is closed
}

TEST_F(ServerTest, StopDoesNotWaitForAClientThatStays) {
  start();
  RawPeer peer(io, server->port());
  peer.hello();
  ASSERT_TRUE(until([&] { return server->client_count() == 1; }));
  const std::int64_t begin_ns = clock.now_ns();
  server->stop();
  io.restart();
  EXPECT_TRUE(until([&] { return io.stopped(); }));
  EXPECT_LT(clock.now_ns() - begin_ns, in_ns(std::chrono::milliseconds(1500)));
}

TEST_F(ServerTest, SnapshotsMayBePublishedFromAnotherThread) {
  start();
  const auto viewer = join();
  ASSERT_TRUE(until([&] { return viewer->topologies == 1; }));
  std::shared_ptr<const MeshState> last;
  std::thread publisher([&] {
    for (int i = 0; i < 300; ++i) publish();
    last = simulation.snapshot();
  });
  const bool arrived = until([&] { return !viewer->frames.empty() && viewer->frames.back().tick == 300; });
  publisher.join();
  ASSERT_TRUE(arrived);
  EXPECT_EQ(viewer->client.mesh().positions(), last->mesh.deformed_vertices);
}

TEST_F(ServerTest, OnlyLoopbackIsBoundUnlessRemoteIsAllowed) {
  ServerOptions options;
  options.address = "0.0.0.0";
  EXPECT_THROW(start(options), UserError);
  options.address = "::";
  EXPECT_THROW(start(options), UserError);
  options.address = "prostate";
  EXPECT_THROW(start(options), UserError);
  options.address = "0.0.0.0";
  options.allow_remote = true;
  start(options);
  EXPECT_EQ(join_as(Role::kViewer, "watch")->welcomes, 1);
}

TEST_F(ServerTest, APortInUseIsNamedWithTheFix) {
  start();
  ServerOptions options;
  options.port = server->port();
  try {
    Server second(io, options, tissue, {});
    FAIL();
  } catch (const UserError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("port " + std::to_string(options.port)), std::string::npos) << text;
    EXPECT_NE(text.find("--port"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace brachy::net::test
