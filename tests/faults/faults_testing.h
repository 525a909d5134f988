#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "net/base/timeout_checks.h"
#include "net/http/http_listener.h"
#include "net/igtl/igtl_server.h"
#include "tests/net/net_testing.h"

namespace brachy::test {

/// Descriptors that this process has open.
std::size_t open_descriptors();

/// One side of a conversation as bytes: its parts are sent one after the other, each once a reply to the one before has
/// arrived. Received data are counted and discarded.
class Talker : public std::enable_shared_from_this<Talker> {
 public:
  Talker(boost::asio::io_context& io, std::uint16_t port, std::vector<net::Bytes> parts);
  void start();
  void close();
  bool has_said_all() const { return said_ == parts_.size(); }
  bool is_ended() const { return is_ended_; }  ///< the other side's end, or a reset, was read
  std::uint64_t received() const { return received_; }

 private:
  void say();
  void listen();

  boost::asio::ip::tcp::socket socket_;
  const std::vector<net::Bytes> parts_;
  std::vector<std::byte> buffer_;
  std::size_t said_ = 0;
  std::uint64_t received_ = 0;
  bool is_saying_ = false, is_ended_ = false;
};

/// A server with all its listeners over a fake simulation, on one io_context.
struct FaultsFixture : net::test::ServerFixture {
  static net::ServerOptions short_timeouts();
  void start_all(net::ServerOptions options = short_timeouts());
  /// One tick of the simulation, sent to all clients.
  void publish_all();
  /// As until(), by 20 ms each time there is nothing to do, and with a tick then, but none before `reader` has the
  /// last: so it misses none, however slow the machine.
  template <class Condition>
  bool until_ticked(Condition&& condition, const net::test::Recorder* reader = nullptr) {
    const auto publish_and_ask = [&] {
      publish_now_and_then(reader);
      return condition();
    };
    return net::test::pump_turns(io, publish_and_ask, [this] { clock.advance(net::TimeoutChecks::kPeriod); });
  }
  /// Checks that a well-behaved client is served: its mesh is the simulation's, bit for bit.
  void expect_a_good_client_is_served();
  bool has_no_lease() const;
  std::size_t sessions() const { return server->client_count() + igtl->client_count(); }

  std::optional<net::HttpListener> http;
  std::optional<net::igtl::IgtlServer> igtl;

 private:
  void publish_now_and_then(const net::test::Recorder* reader);
  std::int64_t published_ns_ = 0;
};

}  // namespace brachy::test
