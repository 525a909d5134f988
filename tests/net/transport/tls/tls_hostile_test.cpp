// Peers of a TLS port that lie, leave or use another protocol: only their own connection ends.
#include <random>

#include "tests/net/transport/tls/tls_fixture.h"

namespace brachy::net::test {
namespace {

struct TlsHostile : TlsFixture {
  void start_tls(ServerOptions options = {}) {
    options.tls = server_context();
    start(options);
  }
  bool nobody_is_left() {
    return until([&] { return server->client_count() == 0; });
  }
  void expect_alive() {
    const auto viewer = join_over_tls(client_context());
    publish();
    EXPECT_TRUE(until([&] { return viewer->client.mesh().tick() == simulation.state().summary.tick; }));
  }
  /// The first bytes of a TLS client.
  Bytes client_hello() {
    const std::unique_ptr<SSL, void (*)(SSL*)> handle(SSL_new(careless_context()->native_handle()), SSL_free);
    BIO* out = BIO_new(BIO_s_mem());
    SSL_set_bio(handle.get(), BIO_new(BIO_s_mem()), out);
    SSL_connect(handle.get());
    Bytes bytes(BIO_ctrl_pending(out));
    BIO_read(out, bytes.data(), static_cast<int>(bytes.size()));
    return bytes;
  }
};

TEST_F(TlsHostile, AHandshakeThatNeverEndsIsEndedWithTheTimeForHello) {
  ServerOptions options;
  options.hello_timeout = std::chrono::milliseconds(200);
  options.drain_timeout = std::chrono::milliseconds(100);
  start_tls(options);
  const Bytes hello = client_hello();
  RawPeer silent(io, server->port()), half(io, server->port()), waiting(io, server->port());
  half.send(std::span<const std::byte>(hello).first(hello.size() / 2));
  waiting.send(hello);  // and never goes on
  ASSERT_TRUE(until([&] { return server->client_count() == 3; }));
  ASSERT_TRUE(until([&] { return log.size() == 3; }));
  for (const std::string& line : log)
    EXPECT_NE(line.find("no HELLO within 200 ms"), std::string::npos) << line;
  expect_alive();
}

TEST_F(TlsHostile, AHandshakeInPiecesOfOneByteIsUnderstood) {
  start_tls();
  const Bytes hello = client_hello();
  RawPeer peer(io, server->port());
  for (const std::byte& byte : hello) {
    peer.send({&byte, 1});
    io.poll();
  }
  std::size_t answered = 0;
  ASSERT_TRUE(until([&] {
    answered += peer.socket().take(SIZE_MAX, [](std::span<const std::byte>) {});
    return answered > 500;  // its certificate, at least
  }));
}

TEST_F(TlsHostile, WhateverComesInsteadOfAHandshakeHarmsNobody) {
  start_tls();
  const Bytes hello = client_hello();
  std::mt19937 random(7);
  for (int i = 0; i < 200; ++i) {
    RawPeer peer(io, server->port());
    Bytes bytes = hello;
    if (i % 4 == 1) bytes.resize(random() % bytes.size());
    if (i % 4 == 2)
      for (std::byte& b : bytes) b = static_cast<std::byte>(random() & 0xFF);
    if (i % 4 == 3) bytes.resize(bytes.size() + random() % 20'000, std::byte{0x16});
    for (int flips = 0; flips < 3 && !bytes.empty(); ++flips)
      bytes[random() % bytes.size()] = static_cast<std::byte>(random() & 0xFF);
    if (!bytes.empty() && i % 8 != 0) bytes[0] = std::byte{0x16};
    peer.send(bytes);
    for (int round = 0; round < 3; ++round) io.poll_one();
    peer.socket().take(SIZE_MAX, [](std::span<const std::byte>) {});
  }
  ASSERT_TRUE(nobody_is_left());
  expect_alive();
}

TEST_F(TlsHostile, GarbageAfterTheHandshakeEndsIt) {
  start_tls();
  RawPeer peer(io, server->port(), 0, client_context());
  peer.hello();
  ASSERT_TRUE(until([&] {
    peer.take();
    return !peer.types.empty();
  }));
  const Bytes garbage(1000, std::byte{0x17});
  peer.socket().send_raw(garbage);
  ASSERT_TRUE(until([&] {
    peer.take();
    return peer.is_ended();
  }));
  ASSERT_TRUE(nobody_is_left());
  EXPECT_NE(log.back().find("TLS"), std::string::npos) << log.back();
  expect_alive();
}

TEST_F(TlsHostile, AWrongMessageIsAnsweredBeforeTheEnd) {
  start_tls();
  RawPeer peer(io, server->port(), 0, client_context());
  peer.hello();
  peer.hello();  // a second one
  peer.send_message(PingMessage{});
  ASSERT_TRUE(until([&] {
    peer.take();
    return peer.is_ended();
  }));
  EXPECT_EQ(peer.fatal(), ErrorCode::kProtocol);
  EXPECT_EQ(peer.socket().failure(), "");  // by close_notify
  peer.close();
  ASSERT_TRUE(nobody_is_left());
}

TEST_F(TlsHostile, APeerMayLeaveWithoutSayingSoAndAtAnyByte) {
  start_tls();
  for (const bool says_so : {false, true}) {
    RawPeer peer(io, server->port(), 0, client_context());
    peer.hello(Role::kDevice);
    ASSERT_TRUE(until([&] {
      peer.take();
      return !peer.types.empty();
    }));
    says_so ? peer.socket().shutdown_tls() : peer.close();
    ASSERT_TRUE(nobody_is_left());
    EXPECT_NE(log.back().find("closed by the peer"), std::string::npos) << log.back();
    EXPECT_TRUE(server->lease_holder(0).empty());
  }
  const Bytes hello = client_hello();
  for (std::size_t size = 0; size < hello.size(); size += 23) {
    RawPeer peer(io, server->port());
    peer.send(std::span<const std::byte>(hello).first(size));
    peer.close();
    ASSERT_TRUE(nobody_is_left());
  }
  expect_alive();
}

}  // namespace
}  // namespace brachy::net::test
