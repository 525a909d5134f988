// Where the daemon connects: a tracker's server, such as PLUS's, moves the needle.
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include "core/base/error.h"
#include "tests/net/igtl/igtl_fixture.h"

namespace brachy::net::igtl {
namespace {

using boost::asio::ip::tcp;

struct IgtlLink : test::IgtlFixture {
  /// A server on a free port of the loopback, or on `port` again.
  void open_tracker(std::uint16_t port = 0) {
    tracker.emplace(io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), port));
  }
  IgtlOptions options(std::uint16_t port) const {
    IgtlOptions o;
    o.listens = false;
    o.connect = LinkTarget{"127.0.0.1", port};
    return o;
  }
  std::uint16_t tracker_port() const { return tracker->local_endpoint().port(); }
  tcp::socket accept() {
    tcp::socket socket(io);
    bool is_there = false;
    tracker->async_accept(socket, [&](const boost::system::error_code& error) { is_there = !error; });
    EXPECT_TRUE(until([&] { return is_there; }));
    return socket;
  }
  void send(tcp::socket& socket, const std::string& name, const RigidTransform& X) {
    const Bytes bytes = encode_transform({2, name, to_timestamp(stamp_ns += 5'000'000)}, X, "OK");
    boost::asio::write(socket, boost::asio::buffer(bytes.data(), bytes.size()));
  }

  std::optional<tcp::acceptor> tracker;
  std::int64_t stamp_ns = 1'700'000'000'000'000'000;
};

TEST_F(IgtlLink, ATrackersToolMovesTheNeedleAndGetsNothing) {
  open_tracker();
  start_both({}, options(tracker_port()));
  tcp::socket socket = accept();
  send(socket, "NeedleToReference", at(1, 2, 3));
  ASSERT_TRUE(until([&] { return poses.size() == 1; }));
  EXPECT_EQ(poses[0].X_WN.p, Vec3(1, 2, 3));
  EXPECT_NE(server->lease_holder(0).find("OpenIGTLink 127.0.0.1"), std::string::npos);
  EXPECT_TRUE(igtl->is_link_up());
  simulation.steps(20);
  igtl->publish(simulation.snapshot());
  send(socket, "NeedleToReference", at(1, 2, 4));
  ASSERT_TRUE(until([&] { return poses.size() == 2; }));
  EXPECT_EQ(socket.available(), 0u);
  EXPECT_EQ(igtl->port(), 0);
}

TEST_F(IgtlLink, ItConnectsAgainOnceTheServerIsBack) {
  open_tracker();
  const std::uint16_t port = tracker_port();
  start_both({}, options(port));
  {
    tcp::socket first = accept();
    ASSERT_TRUE(until([&] { return igtl->is_link_up(); }));
    send(first, "NeedleToReference", at(0, 0, 0));
    ASSERT_TRUE(until([&] { return poses.size() == 1; }));
    tracker.reset();
  }
  ASSERT_TRUE(until([&] { return !igtl->is_link_up(); }));
  EXPECT_EQ(server->lease_holder(0), "") << "the needle is free again";
  ASSERT_TRUE(until([&] { return has_logged("cannot connect to 127.0.0.1:" + std::to_string(port)); }));
  open_tracker(port);
  tcp::socket again = accept();
  send(again, "NeedleToReference", at(0, 0, 1));
  ASSERT_TRUE(until([&] { return poses.size() == 2; }));
}

TEST_F(IgtlLink, ASlicerThatListensIsSentTheScene) {
  open_tracker();
  IgtlOptions o = options(tracker_port());
  o.connect_sends = true;
  start_both({}, o);
  tcp::socket socket = accept();
  ASSERT_TRUE(until([&] { return igtl->is_link_up(); }));
  simulation.steps(5);
  igtl->publish(simulation.snapshot());
  std::array<std::byte, kHeaderSize> header{};
  bool has_come = false;
  boost::asio::async_read(socket, boost::asio::buffer(header.data(), header.size()),
                          [&](const boost::system::error_code& error, std::size_t) { has_come = !error; });
  ASSERT_TRUE(until([&] { return has_come; }));
  EXPECT_EQ(decode_header(header).type, "POLYDATA");
  EXPECT_EQ(decode_header(header).device, "gland");
}

TEST_F(IgtlLink, NamesAndFrameAreTheScenes) {
  open_tracker();
  IgtlOptions o = options(tracker_port());
  o.naming.needle_names = {"StylusTipToTracker"};
  o.naming.X_WF.R = Vec3(-1, -1, 1).asDiagonal();  // LPS
  start_both({}, o);
  tcp::socket socket = accept();
  send(socket, "ReferenceToTracker", at(0, 0, 0));
  send(socket, "StylusTipToTracker", at(1, 2, 3));
  ASSERT_TRUE(until([&] { return poses.size() == 1; }));
  EXPECT_EQ(poses[0].X_WN.p, Vec3(-1, -2, 3));
  EXPECT_EQ(igtl->other_names(), 1u);
}

TEST_F(IgtlLink, AnotherMachineIsRefusedUnlessItIsAllowed) {
  IgtlOptions o = options(18944);
  for (const char* host : {"192.0.2.1", "tracker.example", "::2"}) {
    o.connect->host = host;
    EXPECT_THROW(start_both({}, o), UserError) << host;
  }
}

TEST(LinkTarget, IsHostAndPort) {
  EXPECT_EQ(link_target("localhost:18944", "x").text(), "localhost:18944");
  EXPECT_EQ(link_target("[::1]:18944", "x").host, "::1");
  EXPECT_EQ(link_target("[::1]:18944", "x").text(), "[::1]:18944");
  for (const char* none :
       {"", "localhost", ":18944", "localhost:", "localhost:0", "localhost:70000", "a:18944x"})
    EXPECT_THROW(link_target(none, "x"), UserError) << none;
}

}  // namespace
}  // namespace brachy::net::igtl
