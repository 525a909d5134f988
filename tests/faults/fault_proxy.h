#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace brachy::test {

/// What is done to one direction of a connection.
struct Way {
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};

  std::size_t piece = 64 * 1024;       ///< bytes, most that are read and passed on at once; 1: byte by byte
  std::chrono::microseconds delay{0};  ///< from reading a piece to passing it on; nothing is read meanwhile
  std::uint64_t cut_after = kNever;    ///< bytes; the connection is cut once exactly so many were passed on

  /// A reader that takes `bytes_per_s` and no more, in ten pieces a second.
  static Way at_rate(std::size_t bytes_per_s) {
    return {bytes_per_s / 10, std::chrono::milliseconds(100), kNever};
  }
};

/// How a connection is cut: always both directions at once.
enum class Cut {
  kClose,  ///< either end reads the end of the stream
  kReset,  ///< either end gets a RST
  kSilence,  ///< half-open: nothing passes any more, neither end is told, and that one of them closes stays unknown
};

/// What is done to one connection.
struct Faults {
  Way up = {};    ///< from the client to the server
  Way down = {};  ///< from the server to the client
  Cut cut = Cut::kClose;
  int receive_buffer =
      0;  ///< SO_RCVBUF towards the server, so that it soon feels what is held; 0: the system's
};

/// A TCP proxy on a free port of the loopback that harms what passes it. Without faults it passes on everything, ends of the
/// stream and resets too. Connections are numbered from 0 as they come.
///
///     FaultProxy proxy(io, server.port());
///     proxy.next = {.down = Way{.piece = 1}};   // for connections that come from here on
///     client.connect("127.0.0.1", proxy.port());
///
/// Threads: it makes none; everything happens on the one that runs `io`.
class FaultProxy {
 public:
  FaultProxy(boost::asio::io_context& io, std::uint16_t server_port);
  ~FaultProxy();  ///< as clear(), and no new ones
  FaultProxy(const FaultProxy&) = delete;
  FaultProxy& operator=(const FaultProxy&) = delete;

  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

  Faults next;                                     ///< of connections that come from here on
  std::function<Faults(std::size_t number)> plan;  ///< where set, instead of `next`

  std::size_t count() const { return links_.size(); }   ///< connections that came
  std::uint64_t passed_up(std::size_t number) const;    ///< bytes
  std::uint64_t passed_down(std::size_t number) const;  ///< bytes
  void cut(std::size_t number, Cut how);                ///< now
  void clear();  ///< closes what is left, and numbers begin with 0 again

 private:
  class Link;
  void accept_next();

  boost::asio::io_context& io_;
  boost::asio::ip::tcp::acceptor acceptor_;
  const std::uint16_t server_port_;
  std::vector<std::shared_ptr<Link>> links_;
};

}  // namespace brachy::test
