// brachyd's HTTP port, tested end to end: the viewer's files and the WebSocket.
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <csignal>

#include "tests/apps/http_get.h"
#include "tests/net/http/websocket_peer.h"

namespace brachy {
namespace {

using namespace test;
using boost::asio::ip::tcp;
using net::test::WebSocketPeer;

struct BrachydHttp : ::testing::Test {
  TempFolder folder;
  std::string scene = folder.write("scene.toml", small_scene());
  boost::asio::io_context io;
  tcp::acceptor taken{io, {boost::asio::ip::make_address("127.0.0.1"), 0}};
  std::string taken_port = std::to_string(taken.local_endpoint().port());

  template <class Condition>
  static bool until(WebSocketPeer& page, Condition&& condition) {
    return wait_until(condition, [&] { page.take_soon(); });
  }
};

TEST_F(BrachydHttp, ServesThePageAndItsWebSocketAndEndsWithPagesOpen) {
  RunningBrachyd daemon(scene, {"--http-port", "0"});
  const std::uint16_t port = http_port(daemon);
  ASSERT_NE(port, 0);
  ASSERT_NE(port, daemon.port);
  const std::string page = http_get(port, "/");
  EXPECT_TRUE(page.starts_with("HTTP/1.1 200 OK\r\n")) << page.substr(0, 400);
  EXPECT_NE(page.find("<html"), std::string::npos);
  EXPECT_TRUE(http_get(port, "/../../../etc/passwd").starts_with("HTTP/1.1 404 "));

  WebSocketPeer reading(io, port), stalled(io, port, 4096);
  for (WebSocketPeer* peer : {&reading, &stalled}) {
    ASSERT_TRUE(until(*peer, [&] { return peer->is_open(); })) << peer->answer();
    peer->hello(net::Role::kViewer, net::kSubscribeFullFrames);
  }
  ASSERT_TRUE(until(reading, [&] { return reading.frames.size() >= 3; }));
  EXPECT_EQ(reading.mesh.positions().size(), 3u * 3000);

  daemon.process.send_signal(SIGTERM);
  EXPECT_TRUE(exited(daemon.process.wait(), 0));
  ASSERT_TRUE(until(reading, [&] { return reading.is_ended(); }));
  EXPECT_EQ(reading.fatal(), net::ErrorCode::kShutdown);
  EXPECT_EQ(reading.close_code(), 1000);
}

TEST_F(BrachydHttp, TheSceneOrTheCommandLineTurnItOn) {
  const std::string with_http = folder.write("http.toml", small_scene("http_port = 0\n"));
  RunningBrachyd daemon(with_http);
  EXPECT_NE(http_port(daemon), 0);
  RunningBrachyd without(scene, {"--duration", "0.1"});
  EXPECT_EQ(lines_of(without.process.wait().out).size(), 2u);  // the first line and the summary
}

TEST_F(BrachydHttp, APortInUseIsNamedWithTheOptionForAnother) {
  const Ended ended = run_brachyd({"--config", scene, "--port", "0", "--http-port", taken_port});
  ASSERT_TRUE(exited(ended, 2));
  EXPECT_EQ(ended.out, "");
  const std::string last = lines_of(ended.err).back();
  EXPECT_NE(last.find("port " + taken_port), std::string::npos) << last;
  EXPECT_NE(last.find("--http-port"), std::string::npos) << last;
}

TEST_F(BrachydHttp, CheckConfigNeedsNoPortOfIts) {
  const std::string checked = folder.write("taken.toml", small_scene("http_port = " + taken_port + "\n"));
  EXPECT_TRUE(exited(run_brachyd({"--check-config", checked}), 0));
  const std::string wrong = folder.write("wrong.toml", small_scene("http_port = 70000\n"));
  const Ended ended = run_brachyd({"--check-config", wrong});
  EXPECT_TRUE(exited(ended, 2));
  EXPECT_NE(ended.err.find("http_port"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace brachy
