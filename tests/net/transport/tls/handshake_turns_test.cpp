#include "net/transport/tls/handshake_turns.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>

#include "net/transport/tls/client_hello.h"
#include "tests/net/transport/tls/tls_fixture.h"

namespace brachy::net::test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// How many of those that come each millisecond begin within ten seconds where each takes `cost_ns`.
int begun_in_ten_seconds(std::int64_t cost_ns) {
  HandshakeLimit limit(HandshakeTurns::kShareOfIoThread);
  int begun = 0;
  for (std::int64_t ms = 1; ms <= 10'000; ++ms) {
    if (!limit.may_begin(ms * kMs)) continue;
    limit.spent(cost_ns);
    ++begun;
  }
  return begun;
}

TEST(HandshakeLimit, LeavesTheThreadItsTimeWhateverAKeyCosts) {
  EXPECT_NEAR(begun_in_ten_seconds(0), 1200, 5) << "100 a second and a burst of 200";
  EXPECT_NEAR(begun_in_ten_seconds(300'000), 800, 5);
  EXPECT_NEAR(begun_in_ten_seconds(3'500'000), 69, 2) << "RSA of 4,096 bits: 0.6 % of the milliseconds";
}

TEST(HandshakeLimit, ABurstPassesAndALongPauseAddsNoMore) {
  HandshakeLimit limit(HandshakeTurns::kShareOfIoThread);
  const auto burst = [&](std::int64_t now_ns) {
    int begun = 0;
    for (; limit.may_begin(now_ns); ++begun) limit.spent(kMs);
    return begun;
  };
  EXPECT_EQ(burst(kMs), 40);
  EXPECT_EQ(burst(kMs), 0);
  EXPECT_EQ(burst(1'000'000 * kMs), 40);
}

/// Handshakes of which `steps` holds the one that is being computed.
struct HandshakeOrder : ::testing::Test {
  std::uint64_t wait(const std::string& name) {
    return turns->wait(name.substr(0, 1), [this, name] {
      if (name.ends_with("left")) return false;
      begun.push_back(name);
      turns->compute(
          HandshakeTurns::Step::kFirst, [] {}, [] {});
      return true;
    });
  }
  void compute_all() {
    while (!steps.empty()) {
      const auto step = std::move(steps.front());
      steps.erase(steps.begin());
      step();
      io.poll();
      io.restart();
    }
  }

  ManualClock clock;
  boost::asio::io_context io;
  std::vector<std::function<void()>> steps;
  std::vector<std::string> begun;
  std::shared_ptr<HandshakeTurns> turns = std::make_shared<HandshakeTurns>(
      io, clock, [this](std::function<void()> step) { steps.push_back(std::move(step)); });
};

TEST_F(HandshakeOrder, OneAfterTheOtherAndTheNewestFirst) {
  for (const char* name : {"a0", "a1", "a2 left", "a3"}) wait(name);
  const std::uint64_t closed = wait("a4");
  turns->forget(closed);
  EXPECT_EQ(begun, (std::vector<std::string>{"a0"})) << "the others wait for its first step";
  compute_all();
  EXPECT_EQ(begun, (std::vector<std::string>{"a0", "a3", "a1"}));
  EXPECT_EQ(turns->begun(), 3u);
}

TEST_F(HandshakeOrder, AFloodOfOneOriginDelaysNoOther) {
  for (int i = 0; i < 50; ++i) wait("a" + std::to_string(i));
  wait("b");
  compute_all();
  const auto place = std::find(begun.begin(), begun.end(), "b") - begun.begin();
  EXPECT_LE(place, 10) << "of 51";
  EXPECT_EQ(begun.size(), 51u);
}

std::vector<std::byte> client_hello(std::size_t record, std::size_t message, std::size_t sent) {
  std::vector<std::byte> bytes(sent);
  const std::size_t head[] = {0x16, 3, 1, record >> 8, record & 0xFF, 1, 0, message >> 8, message & 0xFF};
  for (std::size_t i = 0; i < std::min<std::size_t>(sent, 9); ++i) bytes[i] = static_cast<std::byte>(head[i]);
  return bytes;
}

TEST(ClientHello, BeginsAHandshakeOnlyOnceItIsWhole) {
  const auto find = [](const std::vector<std::byte>& bytes) { return find_client_hello(bytes, 8192); };
  for (std::size_t sent = 0; sent < 205; ++sent)
    EXPECT_EQ(find(client_hello(200, 196, sent)), ClientHello::kIncomplete) << sent;
  EXPECT_EQ(find(client_hello(200, 196, 205)), ClientHello::kComplete);
  EXPECT_EQ(find(client_hello(200, 197, 205)), ClientHello::kBad) << "in two records";
  EXPECT_EQ(find(client_hello(9000, 8996, 20)), ClientHello::kBad) << "too long";
  auto other = client_hello(200, 196, 205);
  other[5] = std::byte{2};
  EXPECT_EQ(find(other), ClientHello::kBad);
  other[0] = std::byte{0x17};
  EXPECT_EQ(find(other), ClientHello::kBad);
}

struct HandshakeFlood : TlsFixture {
  ~HandshakeFlood() override {
    thread.stop();
    thread.join();  // before what its steps refer to
  }
  /// A server whose handshakes are computed on another thread.
  void start_with_thread() {
    ServerOptions options;
    options.tls = server_context();
    options.hello_timeout = std::chrono::minutes(10);  // longer than `until` waits for the thread
    options.handshake_thread = [this](std::function<void()> step) {
      boost::asio::post(thread, std::move(step));
    };
    start(options);
  }
  std::unique_ptr<RawPeer> bare_hello() {
    auto peer = std::make_unique<RawPeer>(io, server->port(), 0, client_context());
    peer->hello();  // begins the handshake, of which no more is read
    return peer;
  }

  boost::asio::thread_pool thread{1};
};

TEST_F(HandshakeFlood, OfBareClientHellosOnTheIoThreadFewAreAnsweredAndARightfulClientGetsIn) {
  ServerOptions options;
  options.tls = server_context();
  start(options);
  const auto device = join_over_tls(client_context());
  std::vector<std::unique_ptr<RawPeer>> bare;
  for (int i = 0; i < 1000; ++i) {  // in a second
    bare.push_back(bare_hello());
    clock.advance(std::chrono::milliseconds(1));
    io.poll();
  }
  EXPECT_LE(server->handshakes()->begun(), 202u + 100u);
  bare.clear();
  const auto rightful = join_over_tls(client_context());
  EXPECT_TRUE(until([&] { return rightful->welcomes == 1; }));
  EXPECT_TRUE(device->closed.empty());
}

TEST_F(HandshakeFlood, AnOperatorGetsInBesideHalfOpenHandshakesOfItsOwnAddressAndSessionsAreServed) {
  start_with_thread();
  const auto viewer = join_over_tls(client_context());
  std::vector<std::unique_ptr<RawPeer>> half_open;
  for (int i = 0; i < 200; ++i) half_open.push_back(bare_hello());
  ASSERT_TRUE(until([&] { return server->handshakes()->begun() == 201; }));
  publish();
  ASSERT_TRUE(until([&] { return viewer->frames.size() == 1; }));
  ClientOptions options;
  options.role = Role::kOperator;
  const auto rightful = join_over_tls(client_context(), options);
  EXPECT_EQ(rightful->welcomes, 1);
  publish();
  EXPECT_TRUE(until([&] { return viewer->frames.size() == 2; }));
  EXPECT_TRUE(viewer->closed.empty());
  for (const auto& peer : half_open) {
    peer->socket().take(SIZE_MAX, [](std::span<const std::byte>) {});
    EXPECT_FALSE(peer->is_ended());
  }
}

TEST_F(HandshakeFlood, FortyAtOnceGetTheirMesh) {
  start_with_thread();
  std::vector<std::unique_ptr<Recorder>> clients;
  ClientOptions options;
  options.tls = client_context();
  for (int i = 0; i < 40; ++i) {
    clients.push_back(std::make_unique<Recorder>(io, on_clock(options)));
    clients.back()->client.connect("127.0.0.1", server->port());
  }
  const auto all = [&](const auto& condition) {
    return until([&] { return std::ranges::all_of(clients, [&](const auto& c) { return condition(*c); }); });
  };
  ASSERT_TRUE(all([](const Recorder& c) { return c.welcomes == 1; }));
  publish();
  ASSERT_TRUE(all([](const Recorder& c) { return c.frames.size() == 1; }));
  for (const auto& client : clients)
    EXPECT_EQ(client->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
}

TEST_F(HandshakeFlood, OneThatIsBeingComputedMayLeaveOrBeClosed) {
  start_with_thread();
  for (int i = 0; i < 300; ++i) {
    const auto peer = bare_hello();
    for (int round = 0; round < i % 7; ++round) io.poll_one();
  }
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  std::vector<std::unique_ptr<RawPeer>> half_open;
  for (int i = 0; i < 20; ++i) half_open.push_back(bare_hello());
  ASSERT_TRUE(until([&] { return server->client_count() > 10; }));
  server.reset();
}

TEST_F(HandshakeFlood, WhatAClientSendsWithTheEndOfItsHandshakeIsRead) {
  start_with_thread();
  std::vector<std::unique_ptr<Recorder>> viewers;
  for (int i = 0; i < 20; ++i) viewers.push_back(join_over_tls(client_context()));
  publish();
  for (const auto& viewer : viewers) EXPECT_TRUE(until([&] { return viewer->frames.size() == 1; }));
}

}  // namespace
}  // namespace brachy::net::test
