// HTTP peers that break the protocol, stall, lie or leave: only their own connection ends, and uses little memory.
#include <algorithm>
#include <random>

#include "tests/net/http/http_testing.h"

namespace brachy::net::test {
namespace {

struct HostileHttpTest : HttpFixture {
  void expect_alive() {
    EXPECT_EQ(get("/").status, 200);
    const auto page = join_page();
    publish();
    EXPECT_TRUE(until([&] {
      page->take();
      return page->mesh.tick() == simulation.state().summary.tick;
    }));
    EXPECT_EQ(page->mesh.positions(), simulation.state().mesh.deformed_vertices);
  }
  static std::span<const std::byte> bytes_of(const std::string& text) {
    return std::as_bytes(std::span(text));
  }
};

TEST_F(HostileHttpTest, WhatIsNotHttpIsRefused) {
  start_http();
  for (const auto* text :
       {"BRCY\1\0", "\r\n\r\n\r\nx y\r\n\r\n", "GET /\r\n\r\n", "GET / HTTP/2.0\r\n\r\n",
        "GET / HTTP/1.1\r\nHost localhost\r\n\r\n", "GET / HTTP/1.1\r\nContent-Length: x\r\n\r\n"}) {
    HttpPeer peer(io, http->port());
    peer.send(std::string(text) + "\r\n\r\n");
    ASSERT_TRUE(ends(peer)) << text;
    HttpReply reply;
    ASSERT_TRUE(peer.next(reply)) << text;
    EXPECT_EQ(reply.status, 400) << text;
    EXPECT_NE(reply.body, "");
  }
  expect_alive();
}

TEST_F(HostileHttpTest, AHugeHeaderIsRefusedBeforeItHasCome) {
  start_http();
  HttpPeer peer(io, http->port());
  peer.send("GET / HTTP/1.1\r\n" + host_line() + "X: " + std::string(64 * 1024, 'a'));
  ASSERT_TRUE(ends(peer));
  HttpReply reply;
  ASSERT_TRUE(peer.next(reply));
  EXPECT_EQ(reply.status, 431);
  HttpPeer many(io, http->port());
  std::string lines;
  for (int i = 0; i < 1000; ++i) lines += "X" + std::to_string(i) + ": 1\r\n";
  many.send("GET / HTTP/1.1\r\n" + lines);
  ASSERT_TRUE(ends(many));
  ASSERT_TRUE(many.next(reply));
  EXPECT_EQ(reply.status, 431);
  expect_alive();
}

TEST_F(HostileHttpTest, ASlowHeaderIsNotWaitedFor) {
  HttpOptions options;
  options.request_timeout = std::chrono::milliseconds(200);
  start_http({}, options);
  HttpPeer silent(io, http->port()), dripping(io, http->port());
  const std::string request = "GET / HTTP/1.1\r\n" + host_line() + "X: ";
  std::size_t at = 0;
  EXPECT_TRUE(until([&] {  // a byte at a time is not enough
    dripping.send(at < request.size() ? request.substr(at++, 1) : "a");
    clock.advance(std::chrono::milliseconds(5));
    dripping.take();
    return dripping.is_ended();
  }));
  EXPECT_TRUE(ends(silent));
  HttpPeer idle(io, http->port());  // nor is a connection kept for a request that never comes
  idle.send("GET /nothing HTTP/1.1\r\n" + host_line() + "\r\n");
  EXPECT_TRUE(ends(idle));
  HttpReply reply;
  EXPECT_TRUE(idle.next(reply));
  expect_alive();
}

TEST_F(HostileHttpTest, WhoDoesNotReadTheAnswerIsClosed) {
  const TemporaryFolder folder;
  folder.write("index.html", std::string(16 << 20, 'x'));
  HttpOptions options;
  options.answer_timeout = std::chrono::milliseconds(300);
  start_http({}, options, ServedFiles(folder.path()));
  HttpPeer stalled(io, http->port());
  stalled.send("GET / HTTP/1.1\r\n" + host_line() + "\r\n");
  pass(2 * options.answer_timeout);
  HttpReply reply;
  EXPECT_TRUE(ends(stalled));
  EXPECT_FALSE(stalled.next(reply));
}

TEST_F(HostileHttpTest, AFloodOfConnectionsIsBounded) {
  ServerOptions options;
  options.max_clients = 2;
  options.hello_timeout = std::chrono::milliseconds(3000);
  HttpOptions http_options;
  http_options.request_timeout = std::chrono::milliseconds(3000);
  start_http(options, http_options);
  std::vector<std::unique_ptr<HttpPeer>> peers;
  for (int i = 0; i < 80; ++i) peers.push_back(std::make_unique<HttpPeer>(io, http->port()));
  ASSERT_TRUE(until([&] {
    for (const auto& peer : peers) peer->take();
    return std::count_if(peers.begin(), peers.end(), [](const auto& peer) { return peer->is_ended(); }) == 16;
  }));  // the oldest, for the last
  ASSERT_TRUE(until([&] {
    for (const auto& peer : peers) peer->take();
    return std::all_of(peers.begin(), peers.end(), [](const auto& peer) { return peer->is_ended(); });
  }));
  expect_alive();
}

TEST_F(HostileHttpTest, RandomBytesAndMutatedRequestsHarmNobody) {
  start_http();
  std::mt19937 random(7);
  const Bytes hello = websocket_frame(Opcode::kBinary, [] {
    Bytes bytes;
    encode(HelloMessage{}, 1, 0, bytes);
    return bytes;
  }());
  for (int i = 0; i < 200; ++i) {
    HttpPeer peer(io, http->port());
    std::string request = upgrade_request(http->port());
    if (i % 2 == 0) request[random() % request.size()] = static_cast<char>(random());
    if (i % 8 == 0) request.resize(random() % request.size());
    peer.send(request);
    for (int round = 0; round < 4; ++round) io.poll_one();
    std::string frame;
    for (const std::byte b : hello) frame += static_cast<char>(std::to_integer<unsigned char>(b));
    for (int flips = 0; flips < 3; ++flips) frame[random() % frame.size()] = static_cast<char>(random());
    peer.send(frame);
    for (int round = 0; round < 4; ++round) io.poll_one();
    peer.take();
  }
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  expect_alive();
}

TEST_F(HostileHttpTest, ABadUpgradeIsRefused) {
  start_http();
  const auto without = [&](const std::string& line) {
    std::string request = upgrade_request(http->port());
    const std::size_t at = request.find(line);
    request.erase(at, request.find("\r\n", at) + 2 - at);
    return ask(request).status;
  };
  EXPECT_EQ(without("Upgrade: "), 426);
  EXPECT_EQ(without("Connection: "), 426);
  EXPECT_EQ(without("Sec-WebSocket-Key: "), 400);
  EXPECT_EQ(without("Sec-WebSocket-Version: "), 400);
  std::string request = upgrade_request(http->port());
  request.replace(request.find("Version: 13"), 11, "Version: 12");
  EXPECT_EQ(ask(request).status, 426);
  request = upgrade_request(http->port());
  request.replace(0, 3, "PUT");
  EXPECT_EQ(ask(request).status, 405);
  EXPECT_EQ(ask(upgrade_request(http->port()) + "\x82").status, 400);  // a frame before there is a WebSocket
  EXPECT_EQ(server->client_count(), 0u);
  expect_alive();
}

TEST_F(HostileHttpTest, FramesThatBreakTheRulesEndTheConnectionWithTheirCode) {
  start_http();
  const std::string text = "BRCY";
  const auto code_of = [&](const Bytes& frame) {
    const auto page = join_page();
    page->send(frame);
    EXPECT_TRUE(
        until([&] { return server->client_count() == 0; }));  // whether or not the peer closes its end
    EXPECT_TRUE(ends(*page));
    return page->close_code();
  };
  EXPECT_EQ(code_of(websocket_frame(Opcode::kBinary, bytes_of(text), true, false)), 1002);  // not masked
  EXPECT_EQ(code_of(websocket_frame(Opcode::kText, bytes_of(text))), 1003);
  EXPECT_EQ(code_of(websocket_frame(Opcode::kContinuation, bytes_of(text))), 1002);  // of nothing
  EXPECT_EQ(code_of(websocket_frame(static_cast<Opcode>(3), bytes_of(text))), 1002);
  EXPECT_EQ(code_of(websocket_frame(Opcode::kPing, bytes_of(text), false)),
            1002);  // a control frame in fragments
  EXPECT_EQ(code_of(websocket_frame(Opcode::kPing, bytes_of(std::string(126, 'x')))), 1002);
  Bytes reserved = websocket_frame(Opcode::kBinary, bytes_of(text));
  reserved[0] |= std::byte{0x40};  // compressed, without negotiation
  EXPECT_EQ(code_of(reserved), 1002);
  Bytes oversized = websocket_frame(Opcode::kBinary, bytes_of(std::string(65536 + 33, 'x')));
  EXPECT_EQ(code_of(oversized), 1009);
  oversized.resize(20);  // refused as soon as its length is known
  EXPECT_EQ(code_of(oversized), 1009);
  Bytes fragments;
  for (int i = 0; i < 3; ++i) {
    const Bytes frame = websocket_frame(i == 0 ? Opcode::kBinary : Opcode::kContinuation,
                                        bytes_of(std::string(32'000, 'x')), false);
    fragments.insert(fragments.end(), frame.begin(), frame.end());
  }
  EXPECT_EQ(code_of(fragments), 1009);
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  expect_alive();
}

TEST_F(HostileHttpTest, AWebSocketMessageIsOneMessageNoMoreAndNoLess) {
  ServerOptions options;
  options.drain_timeout = std::chrono::milliseconds(50);  // this peer does not answer the close frame
  start_http(options);
  const auto error_of = [&](auto&& make) {
    const auto page = join_page();
    page->send_frame(Opcode::kBinary, make(*page));
    EXPECT_TRUE(ends(*page));
    EXPECT_EQ(page->close_code(), 1000);
    return page->fatal();
  };
  EXPECT_EQ(error_of([](WebSocketPeer& page) {
              Bytes two = page.encoded(PingMessage{});
              const Bytes second = page.encoded(PingMessage{});
              two.insert(two.end(), second.begin(), second.end());
              return two;
            }),
            ErrorCode::kProtocol);
  EXPECT_EQ(error_of([](WebSocketPeer& page) {
              Bytes half = page.encoded(PingMessage{});
              half.resize(40);
              return half;
            }),
            ErrorCode::kProtocol);
  EXPECT_EQ(error_of([](WebSocketPeer& page) {
              Bytes half = page.encoded(PingMessage{});
              half.resize(7);
              return half;
            }),
            ErrorCode::kProtocol);
  EXPECT_EQ(error_of([](WebSocketPeer&) { return Bytes(); }), ErrorCode::kProtocol);
  EXPECT_EQ(error_of([](WebSocketPeer&) { return Bytes(100, std::byte{0}); }), ErrorCode::kProtocol);
  EXPECT_EQ(error_of([](WebSocketPeer&) {
              Bytes lie;
              encode_header({kProtocolVersion, MessageType::kPose, 0, 65537, 2, 0}, lie);
              return lie;
            }),
            ErrorCode::kTooLarge);
  EXPECT_EQ(error_of([](WebSocketPeer&) {
              Bytes later;
              encode_header({7, MessageType::kPose, 0, 0, 2, 0}, later);
              return later;
            }),
            ErrorCode::kVersion);
  expect_alive();
}

TEST_F(HostileHttpTest, NothingIsLeftOfAPageWhoseLastFramesCameTogether) {
  start_http();
  const Bytes text = {std::byte{'a'}, std::byte{0xFF}};  // no UTF-8
  // The first ends the session, which closes; what comes after finds Beast on the way to that.
  for (int good = 0; good < 4; ++good)
    for (const Bytes& last :
         {websocket_frame(Opcode::kText, text), websocket_frame(Opcode::kBinary, text, true, false),
          websocket_frame(Opcode::kPing, text), websocket_frame(Opcode::kClose, {})}) {
      const auto page = join_page();
      Bytes frames = websocket_frame(Opcode::kBinary, page->encoded(FrameMessage{}));
      for (int i = 0; i < good; ++i) {
        const Bytes ping = websocket_frame(Opcode::kBinary, page->encoded(PingMessage{}));
        frames.insert(frames.end(), ping.begin(), ping.end());
      }
      frames.insert(frames.end(), last.begin(), last.end());
      page->send(frames);
      EXPECT_TRUE(ends(*page));
    }
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  server->stop();
  http->stop();
  EXPECT_TRUE(until([&] { return io.stopped(); })) << "an operation of a connection that is gone still runs";
}

TEST_F(HostileHttpTest, AStalledPageDelaysNobodyAndIsClosed) {
  tissue = line_tissue(4000);
  simulation = FakeSimulation(tissue);
  ServerOptions options;
  options.send_buffer_bytes = 4096;
  options.stall_timeout = std::chrono::milliseconds(2000);
  start_http(options);
  const auto good = join_page();
  const auto stalled = open_page(4096);
  stalled->hello();
  ASSERT_TRUE(until([&] { return server->client_count() == 2; }));
  std::size_t frames = 0;
  ASSERT_TRUE(until([&] {
    if (good->frames.size() == frames) {
      publish(), ++frames;
      clock.advance(std::chrono::milliseconds(33));
    }
    good->take();
    return server->client_count() == 1;
  }));
  EXPECT_GT(good->frames.size(), 1u);
  EXPECT_NE(log.back().find("did not read for 2 s"), std::string::npos) << log.back();
  expect_alive();
}

TEST_F(HostileHttpTest, AStalledPageThatSendsTextIsClosedToo) {
  tissue = line_tissue(4000);
  simulation = FakeSimulation(tissue);
  ServerOptions options;
  options.send_buffer_bytes = 4096;
  options.stall_timeout = std::chrono::milliseconds(300);
  start_http(options);
  const auto stalled = open_page(4096);
  stalled->hello();
  ASSERT_TRUE(until([&] { return server->client_count() == 1; }));
  publish();
  stalled->send_frame(Opcode::kText, bytes_of("a close frame cannot leave"));
  EXPECT_TRUE(until([&] { return server->client_count() == 0; }));
}

TEST_F(HostileHttpTest, APageThatReadsSlowlyButSteadilyStays) {
  tissue = line_tissue(20000);
  simulation = FakeSimulation(tissue);
  ServerOptions options;
  options.send_buffer_bytes = 4096;
  options.ping_interval = std::chrono::milliseconds(50);
  options.silence_timeout = std::chrono::milliseconds(400);
  start_http(options);
  const auto slow = open_page(4096);
  slow->hello(Role::kViewer, kSubscribeFullFrames);  // and says nothing more, not even to a PING
  simulation.step();
  const auto snapshot = simulation.snapshot();
  const std::int64_t end_ns = clock.now_ns() + in_ns(std::chrono::milliseconds(1200));
  server->publish(snapshot);
  ASSERT_TRUE(until_at_once([&] {  // 4 kB every 10 ms, whatever time the system takes for them
    if (slow->take(4096) > 0) {
      server->publish(snapshot);
      clock.advance(std::chrono::milliseconds(10));
    }
    return clock.now_ns() > end_ns || slow->is_ended();
  }));
  EXPECT_FALSE(slow->is_ended()) << log.back();
  EXPECT_EQ(server->client_count(), 1u);
}

TEST_F(HostileHttpTest, APageThatLeavesAtAnyByteIsForgotten) {
  start_http();
  const std::string request = upgrade_request(http->port());
  HelloMessage hello;
  hello.role = Role::kDevice;
  Bytes message;
  encode(hello, 1, 0, message);
  const Bytes frame = websocket_frame(Opcode::kBinary, message);
  for (std::size_t size = 0; size < request.size(); size += 20) {
    HttpPeer peer(io, http->port());
    peer.send(request.substr(0, size));
    io.poll();
  }
  for (std::size_t size = 0; size <= frame.size(); size += 5) {
    const auto page = open_page();
    page->send(std::span<const std::byte>(frame).first(size));
    if (size % 2 == 0) io.poll();
    page->close();
    ASSERT_TRUE(until([&] { return server->client_count() == 0 && server->lease_holder(0).empty(); }));
  }
  expect_alive();
}

}  // namespace
}  // namespace brachy::net::test
