// Peers that announce more than they send, or send extremely slowly, or far too much: each is closed or bounded, on
// every listener, and nothing is allocated for data that have not arrived.
#include <gtest/gtest.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <functional>

#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/codec.h"
#include "net/igtl/codec/message_parser.h"
#include "tests/faults/faults_testing.h"
#include "tests/faults/largest_allocation.h"
#include "tests/net/http/http_testing.h"
#include "tests/net/igtl/igtl_peer.h"
#include "tests/net/raw_peer.h"

namespace brachy::test {
namespace {

using namespace net;
using net::igtl::test::IgtlPeer;
using net::test::HttpPeer;
using net::test::RawPeer;
using net::test::WebSocketPeer;

struct LiesTest : FaultsFixture {
  void SetUp() override {
    tissue = net::test::line_tissue(2);
    simulation = net::test::FakeSimulation(tissue);
    ServerOptions options = short_timeouts();
    options.needles = 1;
    options.max_message_bytes = 1 << 20;
    start_all(options);
    publish_all();
  }
  /// The server ends the connection; its stand-in stops answering PINGs.
  template <class Peer>
  bool ends(Peer& peer) {
    return until_ticked([&] {
      peer.take();
      return peer.is_ended();
    });
  }
  /// Sends `lie` to the server, which must not allocate more for it than may arrive.
  void expect_bounded(const std::function<void()>& lie) {
    forget_allocations();
    lie();
    EXPECT_LE(largest_allocation(), kPiece);
  }
  static constexpr std::size_t kPiece = 64 * 1024;  // the most that any reader here reads at once
};

Bytes header(MessageType type, std::uint32_t length, std::uint64_t sequence) {
  Bytes bytes;
  encode_header({kProtocolVersion, type, 0, length, sequence, 0}, bytes);
  return bytes;
}

TEST_F(LiesTest, OfANativeLengthAreRefusedAtTheHeader) {
  for (const std::uint32_t length : {(1u << 20) + 1, 1u << 24, 1u << 31, 0xFFFFFFFFu}) {
    for (const bool after_hello : {false, true}) {
      RawPeer peer(io, server->port());
      if (after_hello) {
        peer.hello(Role::kDevice);
        ASSERT_TRUE(until([&] {
          peer.take();
          return !peer.types.empty();
        }));
      }
      expect_bounded([&] {
        peer.send(header(after_hello ? MessageType::kPose : MessageType::kHello, length, peer.sent + 1));
        ASSERT_TRUE(ends(peer)) << length;
      });
      EXPECT_EQ(peer.fatal(), ErrorCode::kTooLarge) << length;
      peer.close();
      ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
    }
  }
  expect_a_good_client_is_served();
}

// The largest allowed length, and one byte of the body.
TEST_F(LiesTest, OfALengthThatIsAllowedAreAwaitedWithoutMemoryForThem) {
  RawPeer peer(io, server->port());
  expect_bounded([&] {
    peer.send(header(MessageType::kHello, server->options().max_message_bytes, 1));
    peer.send(Bytes(1));
    ASSERT_TRUE(ends(peer));
  });
  EXPECT_EQ(peer.fatal(), ErrorCode::kTimeout);
}

// Counts and lengths within a body: of its name, its sections and what they hold.
TEST_F(LiesTest, WithinABodyAreRefused) {
  HelloMessage hello;
  hello.name = "liar";
  hello.needle = 0;  // brings a section
  Bytes good;
  encode(hello, 1, 0, good);
  const std::size_t name_size = kHeaderSize + 40, count = name_size + 2 + 4, section_length = count + 4 + 4;
  for (const auto& [at, size] : {std::pair{name_size, 2}, {count, 2}, {section_length, 4}}) {
    Bytes lie = good;
    std::fill_n(lie.begin() + static_cast<std::ptrdiff_t>(at), size, std::byte{0xFF});
    RawPeer peer(io, server->port());
    expect_bounded([&, at = at] {
      peer.send(lie);
      ASSERT_TRUE(ends(peer)) << at;
    });
    EXPECT_EQ(peer.fatal(), ErrorCode::kProtocol) << at;
  }
  expect_a_good_client_is_served();
}

TEST_F(LiesTest, OfAWebSocketFrameAreRefusedAtItsHeader) {
  for (const std::uint64_t length :
       {std::uint64_t{1} << 21, std::uint64_t{1} << 32, (std::uint64_t{1} << 63) - 1, std::uint64_t{1} << 63,
        ~std::uint64_t{0}}) {
    WebSocketPeer page(io, http->port());
    ASSERT_TRUE(until([&] {
      page.take();
      return page.is_open();
    }));
    Bytes frame = {std::byte{0x82}, std::byte{0xFF}};  // binary, whole; masked, eight bytes of length
    igtl::put(frame, length);
    frame.resize(frame.size() + 4 + 10);  // mask, and some of what is announced
    expect_bounded([&] {
      page.send(frame);
      ASSERT_TRUE(ends(page)) << length;
    });
    EXPECT_TRUE(page.close_code() == 1009 || page.close_code() == 1002) << page.close_code();
  }
  expect_a_good_client_is_served();
}

TEST_F(LiesTest, OfAnHttpBodyAreRefused) {
  const std::string host = "Host: 127.0.0.1:" + std::to_string(http->port()) + "\r\n";
  for (const char* line : {"Content-Length: 4294967296", "Content-Length: 18446744073709551615",
                           "Content-Length: 99999999999999999999999", "Content-Length: -1",
                           "Transfer-Encoding: chunked\r\nContent-Length: 18446744073709551615"}) {
    HttpPeer peer(io, http->port());
    expect_bounded([&] {
      peer.send("GET / HTTP/1.1\r\n" + host + line + "\r\n\r\nFFFFFFFFFFFFFFFF\r\n");
      ASSERT_TRUE(ends(peer)) << line;
    });
  }
  expect_a_good_client_is_served();
}

TEST_F(LiesTest, OfAnOpenIgtLinkBodyEndTheConnectionOrAreSkipped) {
  for (const char* type : {"TRANSFORM", "IMAGE", "GET_STATUS"}) {
    for (const std::uint64_t size :
         {std::uint64_t{1} << 17, std::uint64_t{1} << 30, (std::uint64_t{1} << 30) + 1,
          std::uint64_t{1} << 32, std::uint64_t{1} << 63, ~std::uint64_t{0}}) {
      IgtlPeer peer(io, igtl->port());
      Bytes message = igtl::encode_empty(type, {1, "NeedleToRas", 0});
      message.resize(igtl::kHeaderSize - 16);
      igtl::put(message, size);
      igtl::put(message, std::uint64_t{0});
      message.resize(message.size() + 1000);
      const bool is_skipped = size <= igtl::MessageParser::kMaxSkippedBytes;
      expect_bounded([&] {
        peer.send(message);
        ASSERT_TRUE(until_ticked([&] {
          peer.take();
          return is_skipped ? peer.count("TRANSFORM") > 0 : peer.is_ended();
        })) << type
            << " " << size;
      });
      EXPECT_EQ(peer.is_ended(), !is_skipped);
      peer.close();
      ASSERT_TRUE(until_ticked([&] { return sessions() == 0; }));
    }
  }
}

TEST_F(LiesTest, OfAServerAreRefusedByAClient) {
  boost::asio::ip::tcp::acceptor liar(io, {boost::asio::ip::address_v4::loopback(), 0});
  const auto hear = [&](std::uint32_t length) {
    ClientOptions options;
    options.silence_timeout = std::chrono::milliseconds(300);
    auto client = std::make_unique<net::test::Recorder>(io, on_clock(options));
    client->client.connect("127.0.0.1", liar.local_endpoint().port());
    auto socket = liar.accept();
    forget_allocations();
    boost::asio::write(socket, boost::asio::buffer(header(MessageType::kWelcome, length, 1)));
    EXPECT_TRUE(until([&] { return client->closed.size() == 1; })) << length;
    EXPECT_LE(largest_allocation(), 128u * 1024) << length;  // its read buffer, made before
    return client->closed.empty() ? "" : client->closed[0];
  };
  EXPECT_NE(hear(0xFFFFFFFF).find("bad message"), std::string::npos);
  EXPECT_NE(hear(200u << 20).find("stopped sending"), std::string::npos) << "awaited, without memory for it";
}

/// Sends one byte at each call, until none is left.
template <class Send>
auto dripping(Bytes bytes, Send send) {
  return [bytes = std::move(bytes), send, at = std::size_t{0}]() mutable {
    if (at < bytes.size()) send(std::span<const std::byte>(bytes).subspan(at++, 1));
  };
}

Bytes request_bytes(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

// A byte now and then, so that no message is ever complete, on every listener at once; a well-behaved viewer receives
// every snapshot meanwhile.
TEST_F(LiesTest, SlowlorisEndsOnEveryListenerAndDelaysNobody) {
  const auto good = join_as(Role::kViewer, "good");
  Bytes hello;
  encode(HelloMessage{}, 1, 0, hello);
  hello[12] = std::byte{0};
  hello[13] = std::byte{0x10};  // a length of 4096, which is allowed
  hello.resize(4000);
  Bytes pose = header(MessageType::kPose, 4096, 2);
  pose.resize(4000);
  const Bytes request = request_bytes("GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(http->port()) +
                                      "\r\nX: " + std::string(4000, 'x'));
  Bytes transform = igtl::encode_empty("TRANSFORM", {1, "NeedleToRas", 0});
  transform[igtl::kHeaderSize - 10] = std::byte{0x10};  // a body of 4096 bytes
  transform.resize(4000);

  RawPeer native(io, server->port()), welcomed(io, server->port());
  welcomed.hello();
  HttpPeer http_peer(io, http->port());
  WebSocketPeer page(io, http->port());
  ASSERT_TRUE(until([&] {
    page.take();
    return page.is_open();
  }));
  IgtlPeer tracker(io, igtl->port());
  const Bytes frame = net::test::websocket_frame(net::test::Opcode::kBinary, hello);
  auto to_native = dripping(hello, [&](auto byte) { native.send(byte); });
  auto to_welcomed = dripping(pose, [&](auto byte) { welcomed.send(byte); });
  auto to_http =
      dripping(request, [&](auto byte) { http_peer.send(std::string(1, static_cast<char>(byte[0]))); });
  auto to_page = dripping(frame, [&](auto byte) { page.send(byte); });
  auto to_tracker = dripping(transform, [&](auto byte) { tracker.send(byte); });

  const auto take_all = [&] {
    native.take(), welcomed.take(), http_peer.take(), page.take(), tracker.take();
    return native.is_ended() && welcomed.is_ended() && http_peer.is_ended() && page.is_ended() &&
           tracker.is_ended();
  };
  std::int64_t dripped_ns = 0;
  EXPECT_TRUE(until_ticked(
      [&] {
        const std::int64_t now = clock.now_ns();
        if (now - dripped_ns > 20'000'000) {
          dripped_ns = now;
          if (!native.is_ended()) to_native();
          if (!welcomed.is_ended()) to_welcomed();
          if (!http_peer.is_ended()) to_http();
          if (!page.is_ended()) to_page();
          if (!tracker.is_ended()) to_tracker();
        }
        return take_all();
      },
      good.get()))
      << native.is_ended() << welcomed.is_ended() << http_peer.is_ended() << page.is_ended()
      << tracker.is_ended();
  EXPECT_EQ(native.fatal(), ErrorCode::kTimeout);
  EXPECT_EQ(welcomed.fatal(), ErrorCode::kTimeout);
  EXPECT_TRUE(good->closed.empty());
  EXPECT_EQ(good->client.snapshots_missed(), 0u);
  EXPECT_EQ(server->lease_holder(0), "");
}

// 10 kHz for half a second, all at once, must be limited.
TEST_F(LiesTest, AFloodOfPosesIsRefusedBeyondItsLimitAndCounted) {
  constexpr std::uint64_t kPoses = 5000;
  const auto good = join_as(Role::kViewer, "good");
  const std::int64_t begin = clock.now_ns();
  RawPeer flooding(io, server->port());
  flooding.hello(Role::kDevice);
  std::size_t sent = 0;
  ASSERT_TRUE(until_ticked(
      [&] {
        for (int i = 0; i < 100 && sent < kPoses; ++i, ++sent) flooding.send_message(PoseMessage{});
        if (sent == kPoses) flooding.send_message(StateMessage{}), ++sent;  // refused: all before it was read
        flooding.take();
        return flooding.is_ended();
      },
      good.get()));
  const double elapsed_s = 1e-9 * static_cast<double>(clock.now_ns() - begin);
  const double most_accepted = 200 + 2000 * elapsed_s + 1;
  EXPECT_GE(poses.size(), 200u);
  EXPECT_LE(static_cast<double>(poses.size()), most_accepted);
  EXPECT_LE(static_cast<double>(flooding.errors.size()), 2 + elapsed_s + 1);
  ASSERT_TRUE(until_ticked(
      [&] { return !good->states.empty() && good->states.back().poses_accepted == poses.size(); },
      good.get()));
  const StateMessage& state = good->states.back();
  ASSERT_EQ(state.refusals.size(), 1u);
  EXPECT_EQ(state.refusals[0].count + poses.size(), kPoses);
  EXPECT_EQ(good->client.snapshots_missed(), 0u);
  EXPECT_TRUE(good->closed.empty());
}

TEST_F(LiesTest, AFloodOfOpenIgtLinkPosesIsRefusedBeyondItsLimit) {
  const std::int64_t begin = clock.now_ns();
  IgtlPeer flooding(io, igtl->port());
  std::size_t sent = 0;
  ASSERT_TRUE(until_ticked([&] {
    for (int i = 0; i < 100 && sent < 3000; ++i, ++sent) flooding.send_pose("NeedleToRas", RigidTransform{});
    if (sent == 3000) flooding.send_query("GET_CAPABIL"), ++sent;
    flooding.take();
    return flooding.count("CAPABILITY") > 0;
  }));
  const double elapsed_s = 1e-9 * static_cast<double>(clock.now_ns() - begin);
  EXPECT_LE(static_cast<double>(poses.size()), 200 + 2000 * elapsed_s + 1);
  EXPECT_FALSE(flooding.is_ended());
}

}  // namespace
}  // namespace brachy::test
