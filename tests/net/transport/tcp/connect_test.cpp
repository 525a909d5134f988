#include "net/transport/tcp/connect.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/base/error.h"
#include "tests/net/manual_clock.h"

namespace brachy::net::test {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using std::chrono::milliseconds;

struct ConnectTest : ::testing::Test {
  std::string failure(std::uint16_t port) {
    try {
      connect_tcp(io, "127.0.0.1", port, clock, milliseconds(3000));
      return "";
    } catch (const UserError& error) {
      return error.what();
    }
  }

  ManualClock clock;
  asio::io_context io;
};

TEST_F(ConnectTest, AServerThatListensIsConnectedAndAClosedPortIsRefused) {
  tcp::acceptor acceptor(io, {asio::ip::address_v4::loopback(), 0});
  const std::uint16_t port = acceptor.local_endpoint().port();
  EXPECT_EQ(failure(port), "");
  acceptor.close();
  EXPECT_NE(failure(port).find("nothing listens on 127.0.0.1:"), std::string::npos);
  EXPECT_EQ(clock.now_ns(), ManualClock::kBeginNs);
}

TEST_F(ConnectTest, AServerThatDoesNotAnswerIsGivenUpAfterTheTimeout) {
  // Its queue of connections is full: the system answers no further one.
  tcp::acceptor acceptor(io, tcp::v4());
  acceptor.bind({asio::ip::address_v4::loopback(), 0});
  acceptor.listen(0);
  const std::uint16_t port = acceptor.local_endpoint().port();
  tcp::socket first(io);
  first.connect({asio::ip::address_v4::loopback(), port});
  std::atomic<bool> is_over{false};
  std::string told;
  std::thread connecting([&] {
    told = failure(port);
    is_over = true;
  });
  while (!is_over) {
    clock.advance(milliseconds(100));
    std::this_thread::yield();
  }
  connecting.join();
  EXPECT_EQ(told, "no answer from 127.0.0.1:" + std::to_string(port) + " within 3000 ms");
  EXPECT_GE(clock.now_ns() - ManualClock::kBeginNs, in_ns(milliseconds(3000)));
}

}  // namespace
}  // namespace brachy::net::test
