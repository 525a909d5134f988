// Several needles and their devices; forces and local models sent to them.
#include <algorithm>
#include <cmath>

#include "net/server/server.h"
#include "tests/net/net_testing.h"
#include "tests/net/raw_peer.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

struct NeedlesTest : ServerFixture {
  void start_with_needles(std::uint16_t needles) {
    ServerOptions options;
    options.needles = needles;
    start(options);
  }
  std::unique_ptr<Recorder> join_needle(std::uint16_t needle, const std::string& name = "touch") {
    ClientOptions options;
    options.role = Role::kDevice;
    options.needle = needle;
    options.name = name;
    auto recorder = join(options);
    EXPECT_TRUE(until([&] { return recorder->welcomes == 1 || !recorder->closed.empty(); }));
    return recorder;
  }
};

TEST_F(NeedlesTest, EachHasALeaseOfItsOwn) {
  start_with_needles(3);
  const auto left = join_needle(1, "left");
  EXPECT_EQ(left->welcome.needle, 1);
  EXPECT_EQ(left->welcome.needle_count, 3);
  EXPECT_EQ(last_device.needle, 1);
  const auto first = join_needle(kAnyNeedle, "first");
  const auto second = join_needle(kAnyNeedle, "second");
  EXPECT_EQ(first->client.needle(), 0);
  EXPECT_EQ(second->client.needle(), 2);
  left->client.send_pose({}, 11);
  ASSERT_TRUE(until([&] { return poses.size() == 1; }));
  second->client.send_pose({}, 22);
  ASSERT_TRUE(until([&] { return poses.size() == 2; }));
  EXPECT_EQ(pose_needles, (std::vector<std::uint16_t>{1, 2}));
  EXPECT_EQ(poses[1].stamp_ns, 22);
  left->client.request_state();
  ASSERT_TRUE(until([&] { return !left->states.empty() && left->states.back().poses_accepted == 2; }));
  const std::string holders = left->states.back().device_holder;
  EXPECT_EQ(holders.find("0: first (127.0.0.1:"), 0u) << holders;
  EXPECT_NE(holders.find(", 1: left ("), std::string::npos) << holders;
}

TEST_F(NeedlesTest, TheProbeIsLentToWhomAsksForItByItsNumberAlone) {
  ServerOptions options;
  options.needles = 2;
  options.probe_needle = 1;
  start(options);
  const auto first = join_needle(kAnyNeedle, "first");
  EXPECT_EQ(first->client.needle(), 0);
  const auto second = join_needle(kAnyNeedle, "second");
  ASSERT_TRUE(until([&] { return !second->closed.empty(); }));
  EXPECT_EQ(second->errors.at(0).code, ErrorCode::kDeviceBusy);
  EXPECT_TRUE(second->errors[0].text.starts_with("every needle has a device (0: first"))
      << second->errors[0].text;
  const auto probe = join_needle(1, "probe");
  EXPECT_EQ(probe->client.needle(), 1);
}

TEST_F(NeedlesTest, ATakenOneAndOneThatIsNotThereAreRefusedWithTheReason) {
  start_with_needles(2);
  const auto left = join_needle(1, "left");
  const auto taken = join_needle(1, "other");
  ASSERT_TRUE(until([&] { return !taken->closed.empty(); }));
  EXPECT_EQ(taken->errors.at(0).code, ErrorCode::kDeviceBusy);
  EXPECT_NE(taken->errors[0].text.find("left (127.0.0.1:"), std::string::npos) << taken->errors[0].text;
  EXPECT_NE(taken->errors[0].text.find("(needle 1)"), std::string::npos) << taken->errors[0].text;
  const auto beyond = join_needle(2, "other");
  ASSERT_TRUE(until([&] { return !beyond->closed.empty(); }));
  EXPECT_EQ(beyond->errors.at(0).code, ErrorCode::kNoNeedle);
  EXPECT_EQ(beyond->errors[0].text, "there is no needle 2: needles are 0 to 1");
  ASSERT_TRUE(server->hold_lease(0, "scripted device"));
  const auto any = join_needle(kAnyNeedle, "other");
  ASSERT_TRUE(until([&] { return !any->closed.empty(); }));
  EXPECT_EQ(any->errors.at(0).code, ErrorCode::kDeviceBusy);
  EXPECT_NE(any->errors[0].text.find("0: scripted device, 1: left ("), std::string::npos)
      << any->errors[0].text;
}

TEST_F(NeedlesTest, APoseOfAnotherOnesIsRefused) {
  start_with_needles(2);
  const auto viewer = join_as(Role::kViewer, "watch");
  EXPECT_EQ(viewer->welcome.needle, kAnyNeedle);
  RawPeer device(io, server->port());
  device.hello(Role::kDevice);
  PoseMessage pose;
  pose.needle = 1;
  device.send_message(pose);
  ASSERT_TRUE(until([&] {
    device.take();
    return !device.errors.empty();
  }));
  EXPECT_EQ(device.errors[0].code, ErrorCode::kPoseRefused);
  EXPECT_EQ(device.errors[0].reason, kRefusedNeedle);
  EXPECT_NE(device.errors[0].text.find("has needle 0"), std::string::npos) << device.errors[0].text;
  EXPECT_TRUE(poses.empty());
}

TEST_F(NeedlesTest, ADevicesLimitsAndItsEndAreTold) {
  start_with_needles(2);
  ClientOptions options;
  options.role = Role::kDevice;
  options.needle = 1;
  options.evaluates_local_model = true;
  options.limits.max_force_n = 7.5;
  {
    const auto device = join(options);
    ASSERT_TRUE(until([&] { return device->welcomes == 1; }));
    EXPECT_TRUE(last_device.evaluates_local_model);
    EXPECT_EQ(last_device.limits.max_force_n, 7.5);
    EXPECT_EQ(last_device.reason, "");
  }
  ASSERT_TRUE(until([&] { return devices.size() == 2; }));
  EXPECT_EQ(last_device.needle, 1);
  EXPECT_EQ(last_device.reason, "closed by the peer");
}

TEST_F(NeedlesTest, ForcesAndModelsReachTheirDeviceOnly) {
  start_with_needles(2);
  const auto zero = join_needle(0);
  const auto one = join_needle(1);
  ForceMessage force = sample_force();
  force.needle = 1;
  LocalModelMessage model = sample_local_model();
  model.needle = 1;
  EXPECT_TRUE(server->send(1, force));
  EXPECT_TRUE(server->send(1, model));
  ASSERT_TRUE(until([&] { return one->forces.size() == 1 && one->models.size() == 1; }));
  EXPECT_EQ(one->forces[0].forces, force.forces);
  EXPECT_EQ(one->forces[0].flags, force.flags);
  EXPECT_EQ(one->models[0].model, model.model);
  server->broadcast({EventKind::kNote, 0, 0, "all"});
  ASSERT_TRUE(until([&] { return !zero->events.empty() && zero->events.back().text == "all"; }));
  EXPECT_TRUE(zero->forces.empty());
  EXPECT_TRUE(zero->models.empty());
}

TEST_F(NeedlesTest, ForcesWithoutADeviceGoNowhere) {
  start_with_needles(2);
  EXPECT_FALSE(server->send(1, sample_force()));
  ASSERT_TRUE(server->hold_lease(1, "scripted device"));
  EXPECT_FALSE(server->send(1, sample_force()));
  EXPECT_FALSE(server->round_trip_s(1));
}

TEST_F(NeedlesTest, ForcesLeaveBandwidthForEverythingElse) {
  start();
  ClientOptions options;
  options.role = Role::kDevice;
  const auto device = join(options);
  ASSERT_TRUE(until([&] { return device->topologies == 1; }));
  publish();
  ForceMessage force;
  ASSERT_TRUE(until([&] {  // a force waits whenever anything could be written
    for (int i = 0; i < 3; ++i) {
      ++force.tick;
      server->send(0, force);
    }
    clock.advance(std::chrono::milliseconds(1));
    return device->states.size() >= 2 && device->frames.size() == 1;
  }));
  EXPECT_GT(device->forces.size(), 10u);
}

TEST_F(NeedlesTest, TheRoundTripOfADeviceIsMeasured) {
  start_with_needles(2);
  const auto viewer = join_as(Role::kViewer, "watch");
  RawPeer device(io, server->port());
  HelloMessage hello;
  hello.role = Role::kDevice;
  hello.needle = 1;
  device.send_message(hello);
  ASSERT_TRUE(until([&] {
    device.take();
    return std::ranges::count(device.types, MessageType::kPing) == 1;
  }));
  EXPECT_FALSE(server->round_trip_s(1));
  pass(std::chrono::milliseconds(30));
  device.send_message(PingMessage{1, true, 0, 0});
  ASSERT_TRUE(until([&] { return server->round_trip_s(1).has_value(); }));
  EXPECT_GE(*server->round_trip_s(1), 0.030);
  EXPECT_LT(*server->round_trip_s(1), 0.5);
  EXPECT_FALSE(server->round_trip_s(0));
}

TEST_F(NeedlesTest, ADeviceThatOwesAnAnswerIsNotAskedAgainAtOnce) {
  start();
  RawPeer device(io, server->port());
  device.hello(Role::kDevice, kSubscribeNoMesh);
  const auto pings = [&] {
    device.take();
    return std::count(device.types.begin(), device.types.end(), MessageType::kPing);
  };
  ASSERT_TRUE(until([&] { return pings() >= 1; }));
  const auto viewer = join_as(Role::kViewer, "watch");
  ASSERT_TRUE(until([&] { return viewer->states.size() >= 2; }));  // half a second
  EXPECT_LE(pings(), 2);
  EXPECT_FALSE(server->round_trip_s(0));
}

TEST_F(NeedlesTest, MayBeArmedByTheirDeviceOrAnOperatorAndByNobodyElse) {
  start_with_needles(2);
  const auto viewer = join_as(Role::kViewer, "watch");
  const auto chief = join_as(Role::kOperator, "chief");
  const auto device = join_needle(1, "hand");
  device->client.arm();
  ASSERT_TRUE(until([&] { return arms.size() == 1; }));
  EXPECT_EQ(arms[0].first, 1);
  EXPECT_EQ(arms[0].second.find("hand (127.0.0.1:"), 0u) << arms[0].second;
  chief->client.arm(0);
  ASSERT_TRUE(until([&] { return arms.size() == 2; }));
  EXPECT_EQ(arms[1].first, 0);
  device->client.arm(0);
  viewer->client.arm(1);
  chief->client.arm(2);
  ASSERT_TRUE(
      until([&] { return !device->errors.empty() && !viewer->errors.empty() && !chief->errors.empty(); }));
  EXPECT_EQ(device->errors[0].code, ErrorCode::kNotDevice);
  EXPECT_EQ(viewer->errors[0].code, ErrorCode::kNotDevice);
  EXPECT_EQ(chief->errors[0].code, ErrorCode::kNoNeedle);
  for (const auto& client : {&device, &viewer, &chief}) EXPECT_FALSE((*client)->errors[0].fatal);
  EXPECT_EQ(arms.size(), 2u);
}

TEST_F(NeedlesTest, FramesCarryEachOnesForcesAndPoses) {
  simulation = FakeSimulation(tissue, 1, 2);
  start_with_needles(2);
  ClientOptions options;
  options.subscription = kSubscribePoseHistory;
  const auto viewer = join(options);
  simulation.steps(4);
  publish();
  ASSERT_TRUE(until([&] { return viewer->frames.size() == 1; }));
  const FrameMessage& frame = viewer->frames[0];
  ASSERT_EQ(frame.needles.size(), 2u);
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_TRUE(frame.needles[n].has_forces);
    EXPECT_EQ(frame.needles[n].state.forces, simulation.state().needles.states[n].forces);
    EXPECT_EQ(frame.needles[n].state.input.sequence, simulation.state().needles.states[n].input.sequence);
  }
  EXPECT_NE(frame.needles[0].state.forces, frame.needles[1].state.forces);
  EXPECT_EQ(frame.input_sequence, simulation.state().needles.states[1].input.sequence);  // the last to arrive
  EXPECT_EQ(frame.pose_history.size(), 5u);
  ASSERT_EQ(frame.poses_of_needles.size(), 1u);
  EXPECT_EQ(frame.poses_of_needles[0].needle, 1);
  ASSERT_EQ(frame.poses_of_needles[0].poses.size(), 5u);
  EXPECT_EQ(frame.poses_of_needles[0].poses[4].X_WN, simulation.state().needles.states[1].X_WN);
}

TEST_F(NeedlesTest, AForceThatIsNotFiniteIsNotKnown) {
  simulation.state().needles.states[0].forces.axial_n = std::nan("");
  start();
  const auto viewer = join();
  publish();
  ASSERT_TRUE(until([&] { return viewer->frames.size() == 1; }));
  EXPECT_FALSE(viewer->frames[0].needles.at(0).has_forces);
}

TEST_F(NeedlesTest, AButtonIsPressedByTheNeedlesDeviceAlone) {
  start_with_needles(2);
  const auto device = join_needle(1);
  device->client.press(true);
  device->client.press(false);
  ASSERT_TRUE(until([&] { return drops.size() == 2; }));
  EXPECT_EQ(drops, (std::vector<std::pair<std::uint16_t, bool>>{{1, true}, {1, false}}));

  const auto viewer = join_as(Role::kViewer, "viewer");
  viewer->client.press(true);
  ASSERT_TRUE(until([&] { return viewer->errors.size() == 1; }));
  EXPECT_EQ(viewer->errors[0].code, ErrorCode::kNotDevice);
  EXPECT_FALSE(viewer->errors[0].fatal);
  EXPECT_EQ(drops.size(), 2u);
}

TEST_F(NeedlesTest, TooManyDropsEndTheConnectionRatherThanBeingLost) {
  start_with_needles(1);
  const auto device = join_needle(0);
  for (int i = 0; i < 101; ++i) device->client.press(i % 2 == 0);
  ASSERT_TRUE(until([&] { return !device->closed.empty(); }));
  EXPECT_EQ(drops.size(), 100u);
  EXPECT_NE(device->closed[0].find("100 DROPs"), std::string::npos) << device->closed[0];
}

TEST_F(NeedlesTest, PressesAreInOrderWithPosesAndOutliveThem) {
  start_with_needles(1);
  ClientOptions options;
  options.role = Role::kDevice;
  options.max_queued_poses = 4;
  const auto device = join(options);
  ASSERT_TRUE(until([&] { return device->welcomes == 1; }));
  // Nothing is written while the io does not run: poses are dropped, presses are not.
  for (int i = 0; i < 20; ++i) {
    device->client.send_pose({}, i);
    if (i % 5 == 0) device->client.press(i % 10 == 0);
  }
  ASSERT_TRUE(until([&] { return drops.size() == 4; }));
  EXPECT_EQ(drops[3], (std::pair<std::uint16_t, bool>{0, false}));
  EXPECT_GT(device->client.poses_dropped(), 0u);
}

TEST_F(NeedlesTest, TheDoseGoesToWhoGetsTheMeshAlsoToWhoComesLater) {
  start_with_needles(1);
  const auto viewer = join_as(Role::kViewer, "early");
  ClientOptions plain;
  plain.role = Role::kDevice;
  plain.subscription = kSubscribeNoMesh;
  const auto device = join(plain);
  ASSERT_TRUE(until([&] { return device->welcomes == 1; }));
  server->publish(sample_dose());
  ASSERT_TRUE(until([&] { return viewer->doses.size() == 1; }));
  const auto late = join_as(Role::kViewer, "late");
  ASSERT_TRUE(until([&] { return late->doses.size() == 1; }));
  EXPECT_EQ(late->doses[0].structures.at(0).name, "prostate");
  device->client.request_state();
  ASSERT_TRUE(until([&] { return !device->states.empty(); }));
  EXPECT_TRUE(device->doses.empty());
}

}  // namespace
}  // namespace brachy::net::test
