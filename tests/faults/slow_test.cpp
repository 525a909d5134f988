// Connections that are slow, late, held or half-open, and a server that was stopped itself.
#include <iostream>

#include "net/base/timeout_checks.h"
#include "tests/faults/fault_proxy.h"
#include "tests/faults/faults_testing.h"
#include "tests/net/http/http_testing.h"
#include "tests/net/igtl/igtl_peer.h"
#include "tests/net/raw_peer.h"

namespace brachy::test {
namespace {

using namespace net;
using net::igtl::test::IgtlPeer;
using net::test::RawPeer;
using net::test::Recorder;
using net::test::WebSocketPeer;

constexpr Faults kSingleBytes{.up = {.piece = 1}, .down = {.piece = 1}};

struct SlowTest : FaultsFixture {
  void TearDown() override {
    if (!HasFailure()) return;
    for (const std::string& line : log) std::cerr << line << "\n";
  }
  void start_small(ServerOptions options = short_timeouts()) {
    tissue = net::test::line_tissue(10);
    simulation = net::test::FakeSimulation(tissue);
    options.needles = 2;
    start_all(options);
  }
  std::unique_ptr<Recorder> join_through(FaultProxy& proxy, ClientOptions options = {}) {
    auto recorder = std::make_unique<Recorder>(io, on_clock(std::move(options)));
    recorder->client.connect("127.0.0.1", proxy.port());
    return recorder;
  }
};

// Byte by byte, both ways: the same mesh, the same poses.
TEST_F(SlowTest, SingleBytesAreTheSameMeshAndPoses) {
  start_small();
  FaultProxy proxy(io, clock, server->port());
  proxy.next = kSingleBytes;
  ClientOptions options;
  options.role = Role::kDevice;
  const auto device = join_through(proxy, options);
  ASSERT_TRUE(until([&] { return device->welcomes == 1; }));
  for (int i = 0; i < 20; ++i) {
    publish_all();
    ASSERT_TRUE(until([&] {
      return !device->frames.empty() && device->frames.back().tick == simulation.state().summary.tick;
    }));
    ASSERT_EQ(device->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
    device->client.send_pose({Mat3::Identity(), Vec3(0.1 * i, 1.0 / 3, i)}, i + 1);
    ASSERT_TRUE(until([&] { return poses.size() == static_cast<std::size_t>(i + 1); }));
    EXPECT_EQ(poses.back().X_WN.p, Vec3(0.1 * i, 1.0 / 3, i));
    EXPECT_EQ(poses.back().stamp_ns, i + 1);
  }
}

TEST_F(SlowTest, SingleBytesAreTheSameOverWebSocketAndOpenIgtLink) {
  start_small();
  FaultProxy to_http(io, clock, http->port()), to_igtl(io, clock, igtl->port());
  to_http.next = to_igtl.next = kSingleBytes;
  WebSocketPeer page(io, to_http.port());
  ASSERT_TRUE(until([&] {
    page.take();
    return page.is_open();
  }));
  page.hello();
  publish_all();
  ASSERT_TRUE(until([&] {
    page.take();
    return page.mesh.tick() == simulation.state().summary.tick;
  }));
  EXPECT_EQ(page.mesh.positions(), simulation.state().mesh.deformed_vertices);
  page.close();

  IgtlPeer tracker(io, to_igtl.port());
  tracker.send_pose("Needle1ToRas", {Mat3::Identity(), Vec3(1, 2, 3)});
  ASSERT_TRUE(until_ticked([&] {
    tracker.take();
    return poses.size() == 1 && tracker.count("POLYDATA") > 0;
  }));
  EXPECT_EQ(poses[0].X_WN.p, Vec3(1, 2, 3));
}

TEST_F(SlowTest, ADelayIsNoSilence) {
  start_small();
  FaultProxy proxy(io, clock, server->port());
  proxy.next.up = proxy.next.down = {.piece = 1000, .delay = std::chrono::milliseconds(50)};
  const auto viewer = join_through(proxy);
  const std::int64_t end_ns = clock.now_ns() + 3 * in_ns(short_timeouts().silence_timeout);
  while (clock.now_ns() < end_ns) {
    publish_all();
    ASSERT_TRUE(until([&] {
      return !viewer->frames.empty() && viewer->frames.back().tick == simulation.state().summary.tick;
    }));
    ASSERT_EQ(viewer->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
  }
  EXPECT_TRUE(viewer->closed.empty());
}

// It receives few frames, but always the newest, complete and correct; dropped ones are counted; others get all.
TEST_F(SlowTest, ASlowReaderGetsTheNewestAndDelaysNobody) {
  ServerOptions options = short_timeouts();
  options.silence_timeout = options.stall_timeout = std::chrono::seconds(3);  // TCP opens its window in steps
  start_small(options);
  FaultProxy proxy(io, clock, server->port());
  proxy.next.receive_buffer = 4096;
  proxy.next.down = Way::at_rate(10'000);
  const auto good = join_as(Role::kViewer, "good");
  ClientOptions all_points;
  all_points.subscription = kSubscribeFullFrames;
  const auto slow = join_through(proxy, all_points);
  ASSERT_TRUE(until_ticked(
      [&] {
        return slow->client.snapshots_missed() > 10 && !slow->states.empty() &&
               slow->states.back().snapshots_dropped > 10;
      },
      good.get()));
  EXPECT_TRUE(slow->closed.empty());
  EXPECT_TRUE(good->closed.empty());
  EXPECT_EQ(good->client.snapshots_missed(), 0u);
  ASSERT_TRUE(until([&] { return slow->frames.back().tick == simulation.state().summary.tick; }));
  EXPECT_EQ(slow->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
}

// Within its timeout, not one check of the timeouts later; and its needle is free at once.
TEST_F(SlowTest, AHalfOpenPeerIsSeenWithinItsTimeoutAndItsNeedleIsFree) {
  ServerOptions options = short_timeouts();
  options.drain_timeout = std::chrono::seconds(5);
  start_small(options);
  FaultProxy proxy(io, clock, server->port());
  for (const Role role : {Role::kViewer, Role::kDevice}) {
    proxy.clear();
    ClientOptions client;
    client.role = role;
    client.silence_timeout = std::chrono::seconds(30);
    const auto peer = join_through(proxy, client);
    ASSERT_TRUE(until_ticked([&] { return peer->welcomes == 1; }));
    EXPECT_EQ(server->lease_holder(0).empty(), role == Role::kViewer);
    proxy.cut(0, Cut::kSilence);
    const std::int64_t cut_ns = clock.now_ns();
    ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
    const std::int64_t most_ns = in_ns(options.silence_timeout), heard_ns = in_ns(options.ping_interval);
    EXPECT_GE(clock.now_ns() - cut_ns, most_ns - heard_ns - 2 * in_ns(TimeoutChecks::kPeriod));
    EXPECT_LE(clock.now_ns() - cut_ns, most_ns);
    EXPECT_TRUE(server->lease_holder(0).empty()) << "although its last ERROR is still on its way";
    EXPECT_TRUE(peer->closed.empty());
  }
}

TEST_F(SlowTest, AHalfOpenTrackerLosesItsNeedle) {
  start_small();
  FaultProxy proxy(io, clock, igtl->port());
  proxy.next.receive_buffer = 4096;
  IgtlPeer tracker(io, proxy.port());
  tracker.send_pose("Needle0ToRas", RigidTransform{});
  ASSERT_TRUE(until_ticked([&] { return !server->lease_holder(0).empty(); }));
  proxy.cut(0, Cut::kSilence);
  EXPECT_TRUE(until_ticked([&] { return server->lease_holder(0).empty(); }));
  EXPECT_TRUE(until_ticked([&] { return igtl->client_count() == 0; }));
}

// The server is not run for longer than all of its timeouts, as after SIGSTOP; its clients go on meanwhile.
TEST_F(SlowTest, AServerThatWasStoppedBlamesNobodyForIt) {
  start_small();
  RawPeer viewer(io, server->port()), greeting(io, server->port()), dead(io, server->port());
  viewer.hello();
  dead.hello();
  IgtlPeer tracker(io, igtl->port());
  tracker.send_pose("Needle1ToRas", RigidTransform{});
  ASSERT_TRUE(until_ticked([&] {
    viewer.take(), dead.take();
    return !viewer.types.empty() && !dead.types.empty() && !server->lease_holder(1).empty();
  }));

  clock.advance(2 * short_timeouts().silence_timeout);
  viewer.send_message(PingMessage{});
  greeting.hello();
  tracker.send_pose("Needle1ToRas", RigidTransform{});

  EXPECT_TRUE(until_ticked([&] {
    for (RawPeer* peer : {&viewer, &greeting, &dead}) peer->take();
    tracker.take();
    return dead.is_ended();
  }));
  EXPECT_EQ(dead.fatal(), ErrorCode::kTimeout);
  EXPECT_FALSE(viewer.is_ended());
  EXPECT_FALSE(tracker.is_ended());
  EXPECT_FALSE(server->lease_holder(1).empty());
  EXPECT_EQ(std::ranges::count(greeting.types, MessageType::kWelcome), 1);
  EXPECT_EQ(poses.size(), 2u);
}

}  // namespace
}  // namespace brachy::test
