// Peers that read slowly or not at all, unencrypted and over TLS: only the newest frame is sent, no other client waits,
// and a stalled client is closed.
#include <algorithm>

#include "tests/net/transport/tls/tls_fixture.h"

namespace brachy::net::test {
namespace {

/// The parameter: over TLS.
struct SlowReader : TlsFixture, ::testing::WithParamInterface<bool> {
  void start_with_small_buffers(std::uint32_t points, ServerOptions options = {}) {
    tissue = line_tissue(points);
    simulation = FakeSimulation(tissue);
    options.send_buffer_bytes = 4096;
    if (GetParam()) options.tls = server_context();
    start(options);
  }
  TlsContext context() const { return GetParam() ? client_context() : TlsContext(); }
  RawPeer slow_peer() { return RawPeer(io, server->port(), 4096, context()); }
  std::unique_ptr<Recorder> join_good() { return join_over_tls(context()); }

  /// Serves the peer until the condition holds; of TLS it reads the handshake, and no more.
  template <class Condition>
  bool until_there(RawPeer& peer, Condition condition) {
    return until([&] {
      if (GetParam()) peer.take(100);
      return condition() && peer.socket().is_secure() == GetParam();
    });
  }
};

TEST_P(SlowReader, AStalledViewerDelaysNobodyAndCatchesUpBitwise) {
  start_with_small_buffers(4000);
  const auto good = join_good();
  RawPeer stalled = slow_peer();
  stalled.hello();
  ASSERT_TRUE(until_there(stalled, [&] { return server->client_count() == 2; }));
  for (std::size_t i = 1; i <= 60; ++i) {
    publish();
    ASSERT_TRUE(until_at_once([&] { return good->frames.size() == i; }));
    ASSERT_EQ(good->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
  }
  EXPECT_TRUE(stalled.frames.empty());
  ASSERT_TRUE(until_at_once([&] {
    stalled.take();
    return stalled.mesh.tick() == simulation.state().summary.tick;
  }));
  EXPECT_EQ(stalled.mesh.positions(), simulation.state().mesh.deformed_vertices);
  EXPECT_LT(stalled.frames.size(), 10u);
  stalled.send_message(PingMessage{});
  stalled.states.clear();
  ASSERT_TRUE(until([&] {
    stalled.take();
    return !stalled.states.empty();
  }));
  EXPECT_EQ(stalled.states[0].snapshots_sent, stalled.frames.size());
  EXPECT_EQ(stalled.states[0].snapshots_sent + stalled.states[0].snapshots_dropped, 60u);
  EXPECT_EQ(good->client.snapshots_missed(), 0u);
}

TEST_P(SlowReader, AViewerThatNeverReadsIsClosed) {
  ServerOptions options;
  options.stall_timeout = std::chrono::milliseconds(300);
  start_with_small_buffers(4000, options);
  RawPeer stalled = slow_peer();
  stalled.hello();
  ASSERT_TRUE(until_there(stalled, [&] { return server->client_count() == 1; }));
  publish();
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  EXPECT_NE(log.back().find("did not read for 300 ms"), std::string::npos) << log.back();
  const auto good = join_good();
  publish();
  EXPECT_TRUE(until([&] { return good->client.mesh().tick() == simulation.state().summary.tick; }));
  EXPECT_EQ(good->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
}

TEST_P(SlowReader, AViewerThatReadsSlowlyButSteadilyStays) {
  ServerOptions options;
  options.ping_interval = std::chrono::milliseconds(50);
  options.silence_timeout = std::chrono::milliseconds(400);
  start_with_small_buffers(20000, options);
  RawPeer slow = slow_peer();
  slow.hello(Role::kViewer, kSubscribeFullFrames);  // and says nothing more, not even to a PING
  simulation.step();
  const auto snapshot = simulation.snapshot();
  const std::int64_t end_ns = clock.now_ns() + in_ns(std::chrono::milliseconds(1200));
  server->publish(snapshot);
  ASSERT_TRUE(until_at_once([&] {  // 4 kB every 10 ms, whatever time the system takes for them
    if (slow.take(4096) > 0) {
      server->publish(snapshot);
      clock.advance(std::chrono::milliseconds(10));
    }
    return clock.now_ns() > end_ns || slow.is_ended();
  }));
  EXPECT_FALSE(slow.is_ended());
  EXPECT_EQ(server->client_count(), 1u);
}

TEST_P(SlowReader, ADeviceThatDoesNotReadGetsTheNewestForceAndFewOldOnes) {
  start_with_small_buffers(40);
  RawPeer device = slow_peer();
  device.hello(Role::kDevice, kSubscribeNoMesh);
  ASSERT_TRUE(until_there(device, [&] { return !devices.empty(); }));
  constexpr std::uint64_t kSent = 20'000;
  ForceMessage force;
  LocalModelMessage model;
  for (force.tick = 1; force.tick <= kSent; ++force.tick) {
    model.model.tick = force.tick;
    server->send(0, force);
    server->send(0, model);
    while (io.poll_one() > 0) {
    }
  }
  EXPECT_GT(server->forces_replaced(), kSent);  // of twice as many
  ASSERT_TRUE(until([&] {
    device.take();
    return !device.forces.empty() && device.forces.back().tick == kSent && !device.models.empty() &&
           device.models.back().model.tick == kSent;
  }));
  EXPECT_EQ(device.forces.size() + device.models.size() + server->forces_replaced(), 2 * kSent);
  EXPECT_TRUE(std::is_sorted(device.forces.begin(), device.forces.end(),
                             [](const ForceMessage& a, const ForceMessage& b) { return a.tick < b.tick; }));
}

INSTANTIATE_TEST_SUITE_P(Transports, SlowReader, ::testing::Bool(), [](const auto& is_over_tls) {
  return is_over_tls.param ? "OverTls" : "InTheClear";
});

}  // namespace
}  // namespace brachy::net::test
