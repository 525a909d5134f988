#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "net/base/clock.h"
#include "net/base/retry.h"

namespace brachy::net {

/// Where a link leads.
struct LinkTarget {
  std::string host;  ///< a name or an address
  std::uint16_t port = 0;

  std::string text() const;  ///< "HOST:PORT", an IPv6 address in brackets
};

/// Of "HOST:PORT"; IPv6 in brackets. Throws UserError that begins with `what`.
LinkTarget link_target(const std::string& text, const std::string& what);

/// A connection that this side opens, and opens again after each end: at once, then 0.5 s, 1 s … 8 s after each failure
/// (ConnectRetry). Nothing blocks: names are looked up by Asio's own thread.
/// Threads: the io thread only.
class TcpLink : public std::enable_shared_from_this<TcpLink> {
 public:
  struct Handlers {
    std::function<void(boost::asio::ip::tcp::socket)> on_connected;
    std::function<void(const std::string& line)> log;  ///< the first failure after a connection, not each
  };

  TcpLink(boost::asio::io_context& io, TimerClock& clock, LinkTarget target, Handlers handlers);

  void start();
  /// The connection of on_connected has ended: connects again.
  void on_ended();
  /// Connects no more; an attempt that runs is ended.
  void stop();

  const LinkTarget& target() const { return target_; }
  std::uint64_t attempts() const { return attempts_; }

 private:
  void connect();
  void on_resolved(const boost::asio::ip::tcp::resolver::results_type& endpoints);
  void failed(const std::string& why);
  void wait();

  const LinkTarget target_;
  const Handlers handlers_;
  boost::asio::ip::tcp::resolver resolver_;
  boost::asio::ip::tcp::socket socket_;
  TimerClock& clock_;
  const std::unique_ptr<Timer> timer_;  // of the attempt, and of the pause before the next
  ConnectRetry retry_;
  std::uint64_t attempts_ = 0;
  bool is_reported_ = false, is_stopped_ = false;
};

}  // namespace brachy::net
