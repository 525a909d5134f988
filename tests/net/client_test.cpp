#include "net/client/client.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <cmath>

#include "net/base/clock.h"
#include "net/wire/codec.h"
#include "tests/net/net_testing.h"

namespace brachy::net::test {
namespace {

struct ClientTest : ServerFixture {};

/// A listener that passes its first connection to the test and sends what the test asks for.
struct FakeServer {
  explicit FakeServer(boost::asio::io_context& io)
      : acceptor(io, {boost::asio::ip::address_v4::loopback(), 0}), socket(io) {}
  std::uint16_t port() const { return acceptor.local_endpoint().port(); }
  void say(const Bytes& bytes) {
    if (!socket.is_open()) acceptor.accept(socket);
    boost::asio::write(socket, boost::asio::buffer(bytes));
  }
  boost::asio::ip::tcp::acceptor acceptor;
  boost::asio::ip::tcp::socket socket;
};

TEST_F(ClientTest, SaysWhenNothingListens) {
  std::uint16_t port = 0;
  {
    FakeServer gone(io);
    port = gone.port();
  }
  Recorder recorder(io, on_clock());
  try {
    recorder.client.connect("127.0.0.1", port);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_EQ(std::string(error.what()), "nothing listens on 127.0.0.1:" + std::to_string(port) +
                                             ": start brachyd first, or give the port it printed");
  }
  EXPECT_FALSE(recorder.client.is_open());
}

TEST_F(ClientTest, EstimatesTheServersClock) {
  start();
  const auto viewer = join_as(Role::kViewer, "watch");
  ASSERT_TRUE(until([&] { return viewer->client.clock_offset().has_value(); }));
  const ClockOffset::Sample sample = *viewer->client.clock_offset();
  EXPECT_GE(sample.round_trip_ns, 0);
  EXPECT_LE(std::abs(sample.offset_ns), sample.round_trip_ns / 2 + 1);  // one machine, one clock
}

TEST_F(ClientTest, DropsTheOldestWaitingPoses) {
  start();
  ClientOptions options;
  options.role = Role::kDevice;
  options.max_queued_poses = 4;
  const auto device = join(options);
  for (int i = 1; i <= 100; ++i) device->client.send_pose({}, i);
  EXPECT_EQ(device->client.poses_dropped(), 96u);
  ASSERT_TRUE(until([&] { return poses.size() == 4; }));
  EXPECT_EQ(poses.front().stamp_ns, 97);
  EXPECT_EQ(poses.back().stamp_ns, 100);
  EXPECT_EQ(device->client.poses_sent(), 4u);
}

TEST_F(ClientTest, ClosesOnAnythingThatIsNotTheProtocol) {
  const auto closed_after = [&](const Bytes& bytes) {
    FakeServer fake(io);
    Recorder recorder(io, on_clock());
    recorder.client.connect("127.0.0.1", fake.port());
    fake.say(bytes);
    EXPECT_TRUE(until([&] { return !recorder.closed.empty(); }));
    EXPECT_FALSE(recorder.client.is_open());
    return recorder.closed.empty() ? std::string() : recorder.closed[0];
  };
  EXPECT_NE(closed_after(Bytes(40)).find("magic"), std::string::npos);
  Bytes bytes;
  encode(WelcomeMessage{}, 2, 0, bytes);
  EXPECT_NE(closed_after(bytes).find("sequence"), std::string::npos);
  bytes.clear();
  encode(FrameMessage{}, 1, 0, bytes);
  EXPECT_NE(closed_after(bytes).find("before the topology"), std::string::npos);
  bytes.clear();
  encode(HelloMessage{}, 1, 0, bytes);
  EXPECT_NE(closed_after(bytes).find("only a client"), std::string::npos);
  bytes.clear();
  encode(ArmMessage{}, 1, 0, bytes);
  EXPECT_NE(closed_after(bytes).find("only a client"), std::string::npos);
  bytes.clear();
  ForceMessage force;
  force.forces.force_n.x() = std::nan("");
  encode(force, 1, 0, bytes);
  EXPECT_NE(closed_after(bytes).find("not finite"), std::string::npos);
  bytes.clear();
  encode_header({kProtocolVersion, MessageType::kFrame, 0, 0xFFFFFFFF, 1, 0}, bytes);
  EXPECT_NE(closed_after(bytes).find("limit"), std::string::npos);
}

TEST_F(ClientTest, HandsOutEveryMessageAsItCameBeforeItsHandler) {
  FakeServer fake(io);
  std::vector<std::string> order;
  Bytes handed_out;
  ClientHandlers h;
  h.on_message = [&](const Header& header, std::span<const std::byte> body) {
    order.push_back("message");
    encode_header(header, handed_out);
    handed_out.insert(handed_out.end(), body.begin(), body.end());
  };
  h.on_welcome = [&](const WelcomeMessage&) { order.push_back("welcome"); };
  h.on_event = [&](const EventMessage&) { order.push_back("event"); };
  h.on_closed = [&](const std::string&) { order.push_back("closed"); };
  Client client(io, on_clock(), std::move(h));
  client.connect("127.0.0.1", fake.port());
  Bytes said, event, rest;
  encode(WelcomeMessage{}, 1, 5, said);
  encode(EventMessage{EventKind::kNote, 0, 7, "a"}, 2, 6, event);
  said.insert(said.end(), event.begin(), event.end());
  const Bytes good = said;
  encode(PingMessage{}, 3, 7, rest);                                                   // not what is recorded
  encode_header({kProtocolVersion, static_cast<MessageType>(999), 0, 0, 4, 8}, rest);  // of a later version
  encode(FrameMessage{}, 5, 9, rest);  // before any topology: refused
  said.insert(said.end(), rest.begin(), rest.end());
  fake.say(said);
  ASSERT_TRUE(until([&] { return !client.is_open(); }));
  EXPECT_EQ(handed_out, good);
  EXPECT_EQ(order, (std::vector<std::string>{"message", "welcome", "message", "event", "closed"}));
}

TEST_F(ClientTest, GivesUpAServerThatSaysNothing) {
  FakeServer fake(io);
  ClientOptions options;
  options.silence_timeout = std::chrono::milliseconds(200);
  Recorder recorder(io, on_clock(options));
  recorder.client.connect("127.0.0.1", fake.port());
  pass(std::chrono::milliseconds(150));
  EXPECT_TRUE(recorder.closed.empty());
  pass(std::chrono::milliseconds(200));  // it looks every 100 ms
  EXPECT_EQ(recorder.closed, std::vector<std::string>{"the server stopped sending"});
}

TEST_F(ClientTest, TellsTheServersReasonWhenItIsClosed) {
  start();
  const auto viewer = join_as(Role::kViewer, "watch");
  server->stop();
  ASSERT_TRUE(until([&] { return !viewer->closed.empty(); }));
  EXPECT_EQ(viewer->closed, std::vector<std::string>{"the server stops"});
}

TEST(ClockOffset, TheShortestRoundTripCounts) {
  ClockOffset clock;
  EXPECT_FALSE(clock.best());
  clock.add(1000, 6400, 6500, 2100);  // round trip 1000, offset 4900
  clock.add(2000, 7050, 7060, 2110);  // round trip 100, offset 5000
  clock.add(3000, 8900, 8910, 4010);  // round trip 1000
  ASSERT_TRUE(clock.best());
  EXPECT_EQ(clock.best()->offset_ns, 5000);
  EXPECT_EQ(clock.best()->round_trip_ns, 100);
  clock.add(5000, 9000, 8000, 6000);  // the reply left before the request came: ignored
  EXPECT_EQ(clock.best()->round_trip_ns, 100);
}

}  // namespace
}  // namespace brachy::net::test
