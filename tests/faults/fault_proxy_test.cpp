// The proxy itself, between two plain sockets.
#include "tests/faults/fault_proxy.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <string>

#include "tests/net/net_testing.h"

namespace brachy::test {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

struct FaultProxyTest : ::testing::Test {
  void connect(const Faults& faults) {
    proxy.next = faults;
    client.connect({asio::ip::address_v4::loopback(), proxy.port()});
    ASSERT_TRUE(until([&] { return proxy.count() == 1; }));
    server = acceptor.accept();
    client.non_blocking(true);
    server.non_blocking(true);
  }
  /// Sends and serves the proxy until the other end has read `size` bytes, or its end.
  std::string through(tcp::socket& from, tcp::socket& to, const std::string& given, std::size_t size) {
    std::string got;
    std::size_t sent = 0;
    EXPECT_TRUE(until([&] {
      boost::system::error_code error;
      sent += from.write_some(asio::buffer(given) + sent, error);
      char buffer[4096];
      const std::size_t read = to.read_some(asio::buffer(buffer), error);
      got.append(buffer, read);
      end = error == asio::error::would_block ? boost::system::error_code() : error;
      return got.size() >= size || end;
    }));
    return got;
  }

  template <class Condition>
  bool until(Condition&& condition) {
    return net::test::pump_turns(io, condition, [this] { clock.advance(std::chrono::milliseconds(1)); });
  }

  net::test::ManualClock clock;
  asio::io_context io;
  tcp::acceptor acceptor{io, {asio::ip::address_v4::loopback(), 0}};
  FaultProxy proxy{io, clock, acceptor.local_endpoint().port()};
  tcp::socket client{io}, server{io};
  boost::system::error_code end;  // of the reading side; none: it goes on
  const std::string text = [] {
    std::string made(3001, 'x');
    made.back() = 'y';
    return made;
  }();
};

TEST_F(FaultProxyTest, PassesOnEverythingWithoutFaults) {
  connect({});
  EXPECT_EQ(through(client, server, text, text.size()), text);
  EXPECT_EQ(through(server, client, text, text.size()), text);
  EXPECT_TRUE(until([&] { return proxy.passed_up(0) + proxy.passed_down(0) == 2 * text.size(); }));
  client.shutdown(tcp::socket::shutdown_send);
  through(client, server, "", 1);
  EXPECT_EQ(end, asio::error::eof);
  EXPECT_EQ(through(server, client, "more", 4), "more") << "only one direction has ended";
}

TEST_F(FaultProxyTest, PassesOnSingleBytesInOrder) {
  connect({.up = {.piece = 1}, .down = {.piece = 1}});
  EXPECT_EQ(through(client, server, text, text.size()), text);
  EXPECT_EQ(through(server, client, text, text.size()), text);
}

TEST_F(FaultProxyTest, CutsAfterExactlySoManyBytes) {
  connect({.down = {.cut_after = 1234}});
  EXPECT_EQ(through(client, server, text, text.size()), text);
  EXPECT_EQ(through(server, client, text, text.size()).size(), 1234u);
  EXPECT_EQ(end, asio::error::eof);
  through(client, server, "", 1);
  EXPECT_EQ(end, asio::error::eof) << "both directions";
}

TEST_F(FaultProxyTest, ResetsBothEnds) {
  connect({.up = {.cut_after = 10}, .cut = Cut::kReset});
  through(client, server, text, 11);
  EXPECT_EQ(end, asio::error::connection_reset);
  through(server, client, "", 1);
  EXPECT_EQ(end, asio::error::connection_reset);
}

TEST_F(FaultProxyTest, FallsSilentAndTellsNobody) {
  connect({.up = {.cut_after = 10}, .cut = Cut::kSilence});
  EXPECT_EQ(through(client, server, text, 10).size(), 10u);
  client.close();
  asio::write(server, asio::buffer(text));
  for (int i = 0; i < 20; ++i) io.poll();
  char byte = 0;
  server.read_some(asio::buffer(&byte, 1), end);
  EXPECT_EQ(end, asio::error::would_block);
  EXPECT_EQ(proxy.passed_up(0), 10u);
}

TEST_F(FaultProxyTest, ReadsNoFasterThanItIsTold) {
  connect({.down = {.piece = 100, .delay = std::chrono::milliseconds(10)}});
  const std::int64_t begin_ns = clock.now_ns();
  EXPECT_EQ(through(server, client, text, text.size()), text);
  EXPECT_GE(clock.now_ns() - begin_ns, 300'000'000);  // 31 pieces of 10 ms
}

}  // namespace
}  // namespace brachy::test
