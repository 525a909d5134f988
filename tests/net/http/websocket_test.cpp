// The native protocol over WebSocket: the same sessions as over TCP.
#include <algorithm>

#include "tests/net/http/http_testing.h"

namespace brachy::net::test {
namespace {

struct WebSocketTest : HttpFixture {
  template <class Peer>
  bool heard(Peer& peer, MessageType type) {
    return until([&] {
      peer.take();
      return std::count(peer.types.begin(), peer.types.end(), type) > 0;
    });
  }
};

TEST_F(WebSocketTest, TheSameSessionAsOverTcpGivesTheSameFrames) {
  start_http();
  RawPeer tcp(io, server->port());
  tcp.hello();
  const auto page = join_page();
  ASSERT_TRUE(until([&] { return server->client_count() == 2; }));
  for (std::size_t i = 1; i <= 20; ++i) {
    publish();
    ASSERT_TRUE(until([&] {
      tcp.take();
      page->take();
      return tcp.frames.size() == i && page->frames.size() == i;
    }));
  }
  EXPECT_EQ(page->frame_bodies, tcp.frame_bodies);
  EXPECT_EQ(page->mesh.positions(), simulation.state().mesh.deformed_vertices);
  EXPECT_EQ(page->types[0], MessageType::kWelcome);
  EXPECT_EQ(page->types[1], MessageType::kTopology);
}

TEST_F(WebSocketTest, APageCanBeTheDevice) {
  start_http();
  const auto page = join_page(Role::kDevice);
  EXPECT_TRUE(server->lease_holder(0).starts_with("page (127.0.0.1:"));
  PoseMessage pose;
  pose.X_WN.p = Vec3(1, 2, 3);
  page->send_message(pose);
  ASSERT_TRUE(until([&] { return poses.size() == 1; }));
  EXPECT_EQ(poses[0].X_WN.p, Vec3(1, 2, 3));
  EXPECT_EQ(poses[0].sequence, 2u);
  ForceMessage force;
  force.forces.force_n = Vec3(0, 0, -1);
  EXPECT_TRUE(server->send(0, force));
  ASSERT_TRUE(heard(*page, MessageType::kForce));
  EXPECT_EQ(page->forces[0].forces.force_n, Vec3(0, 0, -1));
  page->close();
  ASSERT_TRUE(until([&] { return server->lease_holder(0).empty(); }));
}

TEST_F(WebSocketTest, AMessageInFragmentsWithPingsBetweenThemIsOneMessage) {
  start_http();
  const auto page = open_page();
  HelloMessage hello;
  hello.name = "fragments";
  const Bytes message = page->encoded(hello);
  const std::span<const std::byte> bytes(message);
  const std::array<std::byte, 3> nonce = {std::byte{7}, std::byte{8}, std::byte{9}};
  page->send(websocket_frame(Opcode::kBinary, bytes.first(1), false));
  page->send_frame(Opcode::kPing, nonce);
  page->send(websocket_frame(Opcode::kContinuation, bytes.subspan(1, 30), false));
  page->send(websocket_frame(Opcode::kContinuation, {}, false));
  page->send(websocket_frame(Opcode::kContinuation, bytes.subspan(31), true));
  ASSERT_TRUE(heard(*page, MessageType::kWelcome));
  EXPECT_EQ(page->pongs, 1u);
  EXPECT_TRUE(std::equal(nonce.begin(), nonce.end(), page->last_pong.begin(), page->last_pong.end()));
}

TEST_F(WebSocketTest, FramesInPiecesOfOneByteAreUnderstood) {
  start_http();
  const auto page = open_page();
  const Bytes frame = websocket_frame(Opcode::kBinary, page->encoded(HelloMessage{}));
  for (const std::byte& byte : frame) {
    page->send({&byte, 1});
    io.poll();
  }
  EXPECT_TRUE(heard(*page, MessageType::kWelcome));
}

TEST_F(WebSocketTest, APageThatClosesIsAnsweredAndForgotten) {
  start_http();
  const auto page = join_page();
  const std::array<std::byte, 2> code = {std::byte{0x03}, std::byte{0xE9}};  // 1001: the page is left
  page->send_frame(Opcode::kClose, code);
  ASSERT_TRUE(ends(*page));
  EXPECT_EQ(page->close_code(), 1001);
  page->close();
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  EXPECT_NE(log.back().find("closed by the peer"), std::string::npos) << log.back();
}

TEST_F(WebSocketTest, ClientsOfBothPortsShareThePlaces) {
  ServerOptions options;
  options.max_clients = 4;
  start_http(options);
  const auto tcp_1 = join_as(Role::kViewer, "1"), tcp_2 = join_as(Role::kViewer, "2");
  auto page_3 = join_page();
  const auto page_4 = join_page();
  EXPECT_EQ(server->client_count(), 4u);
  const auto page_5 = join_page();
  ASSERT_TRUE(ends(*page_5));
  EXPECT_EQ(page_5->fatal(), ErrorCode::kBusy);
  EXPECT_EQ(page_5->close_code(), 1000);
  const auto tcp_5 = join();
  ASSERT_TRUE(until([&] { return !tcp_5->closed.empty(); }));
  EXPECT_EQ(tcp_5->errors.at(0).code, ErrorCode::kBusy);
  EXPECT_EQ(get("/").status, 503);
  page_3->close();
  ASSERT_TRUE(until([&] { return server->client_count() == 3; }));
  EXPECT_EQ(join_page()->types.at(0), MessageType::kWelcome);
}

TEST_F(WebSocketTest, ASilentPageIsAskedAndThenClosed) {
  ServerOptions options;
  options.ping_interval = std::chrono::milliseconds(50);
  options.silence_timeout = std::chrono::milliseconds(300);
  start_http(options);
  const auto page = join_page();
  ASSERT_TRUE(until([&] {
    if (!page->is_ended()) page->send_frame(Opcode::kPing, {});  // is no message
    clock.advance(std::chrono::milliseconds(5));
    page->take();
    return page->is_ended();
  }));
  EXPECT_EQ(page->fatal(), ErrorCode::kTimeout);
  EXPECT_GE(std::count(page->types.begin(), page->types.end(), MessageType::kPing), 1);
}

TEST_F(WebSocketTest, NoHelloAfterTheUpgradeEndsIt) {
  ServerOptions options;
  options.hello_timeout = std::chrono::milliseconds(100);
  start_http(options);
  const auto page = open_page();
  ASSERT_TRUE(ends(*page));
  EXPECT_EQ(page->fatal(), ErrorCode::kTimeout);
  EXPECT_EQ(page->close_code(), 1000);
}

TEST_F(WebSocketTest, OnlyThePageThatWasServedHereConnects) {
  start_http();
  const std::string own = "Origin: http://127.0.0.1:" + std::to_string(http->port()) + "\r\n";
  EXPECT_EQ(ask(upgrade_request(http->port(), own)).status, 101);
  for (const auto* origin : {"http://evil.example", "null", "http://127.0.0.1:1"}) {
    const HttpReply reply = ask(upgrade_request(http->port(), "Origin: " + std::string(origin) + "\r\n"));
    EXPECT_EQ(reply.status, 403) << origin;
    EXPECT_NE(reply.body.find("Origin"), std::string::npos) << reply.body;
  }
  EXPECT_NE(log.back().find("refused"), std::string::npos) << log.back();
  std::string rebound = upgrade_request(http->port());
  rebound.replace(rebound.find("127.0.0.1"), 9, "evil.example");
  EXPECT_EQ(ask(rebound).status, 403);
}

}  // namespace
}  // namespace brachy::net::test
