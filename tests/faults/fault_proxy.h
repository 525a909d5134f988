#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "net/base/clock.h"

namespace brachy::test {

/// Faults of one direction of a connection.
struct Way {
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};

  std::size_t piece = 64 * 1024;       ///< most bytes that are read and forwarded at once; 1: byte by byte
  std::chrono::microseconds delay{0};  ///< from reading a piece to forwarding it; nothing is read meanwhile
  std::uint64_t cut_after = kNever;    ///< the connection is cut once exactly so many bytes were forwarded

  /// A reader of at most `bytes_per_s`, in ten pieces a second.
  static Way at_rate(std::size_t bytes_per_s) {
    return {bytes_per_s / 10, std::chrono::milliseconds(100), kNever};
  }
};

/// How a connection is cut: always both directions at once.
enum class Cut {
  kClose,    ///< either end reads the end of the stream
  kReset,    ///< either end gets a RST
  kSilence,  ///< half-open: nothing is forwarded any more, neither end is notified, even if the other closes
};

/// Faults of one connection.
struct Faults {
  Way up = {};    ///< from the client to the server
  Way down = {};  ///< from the server to the client
  Cut cut = Cut::kClose;
  /// SO_RCVBUF towards the server, so that it soon feels what is held; 0: the system's
  int receive_buffer = 0;
};

/// A TCP proxy on a free port of the loopback that injects faults. Without faults it forwards everything, including
/// ends of the stream and resets. Connections are numbered from 0 in the order of arrival.
///
///     FaultProxy proxy(io, clock, server.port());
///     proxy.next = {.down = Way{.piece = 1}};   // for later connections
///     client.connect("127.0.0.1", proxy.port());
///
/// Threads: creates none; everything happens on the one that runs `io`.
class FaultProxy {
 public:
  /// `clock`: of the delays; it outlives `io`.
  FaultProxy(boost::asio::io_context& io, net::TimerClock& clock, std::uint16_t server_port);
  ~FaultProxy();  ///< as clear(), and no new ones
  FaultProxy(const FaultProxy&) = delete;
  FaultProxy& operator=(const FaultProxy&) = delete;

  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

  Faults next;                                     ///< of later connections
  std::function<Faults(std::size_t number)> plan;  ///< where set, instead of `next`

  std::size_t count() const { return links_.size(); }   ///< connections accepted
  std::uint64_t passed_up(std::size_t number) const;    ///< bytes
  std::uint64_t passed_down(std::size_t number) const;  ///< bytes
  void cut(std::size_t number, Cut how);                ///< now
  void clear();  ///< closes all connections, and numbers begin with 0 again

 private:
  class Link;
  void accept_next();

  boost::asio::io_context& io_;
  net::TimerClock& clock_;
  boost::asio::ip::tcp::acceptor acceptor_;
  const std::uint16_t server_port_;
  std::vector<std::shared_ptr<Link>> links_;
};

}  // namespace brachy::test
