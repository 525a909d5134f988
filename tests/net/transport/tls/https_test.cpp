// The viewer's files and the WebSocket over TLS.
#include <algorithm>

#include "tests/net/transport/tls/tls_fixture.h"

namespace brachy::net::test {
namespace {

struct Https : TlsFixture {
  void start_https(ServerOptions options = {}, HttpOptions http_options = {}) {
    options.tls = server_context();
    tls = client_context();
    folder.write("index.html", "<html>the viewer</html>");
    start_http(options, http_options, ServedFiles(folder.path()));
  }
  bool is_logged(const std::string& part) {
    return until([&] {
      return std::ranges::any_of(
          log, [&](const std::string& line) { return line.find(part) != std::string::npos; });
    });
  }
  HttpReply reply_of(HttpPeer& peer) {
    HttpReply reply;
    EXPECT_TRUE(until([&] {
      peer.take();
      return peer.next(reply) || peer.is_ended();
    }));
    return reply;
  }
};

TEST_F(Https, ServesThePage) {
  start_https();
  const HttpReply reply = get("/");
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, "<html>the viewer</html>");
  EXPECT_NE(reply.headers.at("content-security-policy").find("wss:"), std::string::npos);
  EXPECT_EQ(get("/nothing").status, 404);
}

TEST_F(Https, AConnectionIsUsedAgainAndEndsInOrder) {
  start_https();
  HttpPeer peer(io, http->port(), tls);
  for (int i = 0; i < 3; ++i) {
    peer.send("GET / HTTP/1.1\r\n" + host_line() + "\r\n");
    EXPECT_EQ(reply_of(peer).status, 200);
  }
  peer.send("GET / HTTP/1.1\r\n" + host_line() + "Connection: close\r\n\r\n");
  EXPECT_EQ(reply_of(peer).status, 200);
  EXPECT_TRUE(ends(peer));
  EXPECT_EQ(peer.socket().failure(), "");
  EXPECT_NE(SSL_get_shutdown(peer.socket().tls()) & SSL_RECEIVED_SHUTDOWN, 0);
}

TEST_F(Https, APageOverItIsASessionLikeAnyOther) {
  start_https();
  const auto native = join_over_tls(client_context());
  const auto page = join_page(Role::kDevice);
  EXPECT_TRUE(server->lease_holder(0).starts_with("page (127.0.0.1:"));
  for (std::size_t i = 1; i <= 20; ++i) {
    publish();
    ASSERT_TRUE(until([&] {
      page->take();
      return page->frames.size() == i && native->frames.size() == i;
    }));
  }
  EXPECT_EQ(page->mesh.positions(), simulation.state().mesh.deformed_vertices);
  PoseMessage pose;
  pose.X_WN.p = Vec3(1, 2, 3);
  page->send_message(pose);
  ASSERT_TRUE(until([&] { return poses.size() == 1; }));
  server->stop();
  ASSERT_TRUE(ends(*page));
  EXPECT_EQ(page->fatal(), ErrorCode::kShutdown);
  EXPECT_EQ(page->close_code(), 1000);
}

TEST_F(Https, APageThatClosesIsAnsweredAndForgotten) {
  start_https();
  const auto page = join_page();
  const std::array<std::byte, 2> code = {std::byte{0x03}, std::byte{0xE9}};
  page->send_frame(Opcode::kClose, code);
  ASSERT_TRUE(ends(*page));
  EXPECT_EQ(page->close_code(), 1001);
  page->close();
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  EXPECT_NE(log.back().find("closed by the peer"), std::string::npos) << log.back();
}

TEST_F(Https, OnlyAPageThatWasServedOverItConnects) {
  start_https();
  const std::string authority = "127.0.0.1:" + std::to_string(http->port());
  EXPECT_EQ(ask(upgrade_request(http->port(), "Origin: https://" + authority + "\r\n")).status, 101);
  EXPECT_EQ(ask(upgrade_request(http->port(), "Origin: http://" + authority + "\r\n")).status, 403);
  EXPECT_EQ(ask(upgrade_request(http->port(), "Origin: https://evil.example\r\n")).status, 403);
}

TEST_F(Https, APlainRequestIsToldSo) {
  start_https();
  tls.reset();
  const HttpReply reply = get("/");
  EXPECT_EQ(reply.status, 400);
  EXPECT_NE(reply.body.find("https://"), std::string::npos) << reply.body;
  EXPECT_TRUE(is_logged("speaks HTTPS"));
}

TEST_F(Https, TlsOnAPlainPortIsToldSo) {
  start_http();
  HttpPeer peer(io, http->port(), client_context());
  ASSERT_TRUE(ends(peer));
  EXPECT_NE(peer.socket().failure(), "");
  EXPECT_TRUE(is_logged("without TLS"));
}

TEST_F(Https, WhoShowsNoCertificateIsRefusedWhereOneIsAskedFor) {
  ServerOptions options;
  options.tls = server_context(ca.certificate());
  start_http(options);
  HttpPeer without(io, http->port(), client_context());
  without.send("GET / HTTP/1.1\r\n" + host_line() + "\r\n");
  ASSERT_TRUE(ends(without));
  EXPECT_NE(without.socket().failure().find("certificate"), std::string::npos) << without.socket().failure();
  EXPECT_TRUE(is_logged("shows no certificate"));
  const Identity own = ca.issue("client", {"client", ""});
  tls = make_client_context({ca.certificate(), own.certificate, own.key});
  EXPECT_EQ(get("/").status, 200);
}

TEST_F(Https, AHandshakeThatNeverEndsIsClosed) {
  ServerOptions options;
  options.hello_timeout = std::chrono::milliseconds(100);
  start_https(options);
  HttpPeer silent(io, http->port()), half(io, http->port());
  half.send("\x16\x03\x01");
  EXPECT_TRUE(ends(silent));
  EXPECT_TRUE(ends(half));
  EXPECT_EQ(get("/").status, 200);
}

TEST_F(Https, AStalledPageIsClosedAndDelaysNobody) {
  tissue = line_tissue(4000);
  simulation = FakeSimulation(tissue);
  ServerOptions options;
  options.send_buffer_bytes = 4096;
  options.stall_timeout = std::chrono::milliseconds(300);
  start_https(options);
  const auto good = join_over_tls(client_context());
  const auto stalled = open_page(4096);
  stalled->hello();
  ASSERT_TRUE(until([&] { return server->client_count() == 2; }));
  for (std::size_t i = 1; i <= 30; ++i) {
    publish();
    ASSERT_TRUE(until_at_once([&] { return good->frames.size() == i; }));
  }
  ASSERT_TRUE(until([&] { return server->client_count() == 1; }));
  EXPECT_TRUE(is_logged("did not read for 300 ms"));
  EXPECT_TRUE(good->closed.empty());
}

}  // namespace
}  // namespace brachy::net::test
