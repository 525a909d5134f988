#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace brachy::net {

/// Where to listen.
struct ListenOptions {
  std::string address = "127.0.0.1";   ///< an IP address, or localhost
  std::uint16_t port = 0;              ///< 0 = any free one
  bool allow_remote = false;           ///< take an address that is not loopback
  std::string port_option = "--port";  ///< what the user gives to choose another port
};

/// Listens and hands over connected sockets. An accept that fails (no descriptors left, …) is tried again after
/// 100 ms, for ever. Threads: the io thread.
class Acceptor : public std::enable_shared_from_this<Acceptor> {
 public:
  using OnSocket = std::function<void(boost::asio::ip::tcp::socket)>;
  using Log = std::function<void(const std::string&)>;

  /// Binds and listens. Throws UserError that names the fix.
  Acceptor(boost::asio::io_context& io, const ListenOptions& options);

  void start(OnSocket on_socket, Log log);
  void stop();  ///< no call of on_socket or log after it
  std::uint16_t port() const { return port_; }

 private:
  void accept_next();

  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  std::uint16_t port_ = 0;
  OnSocket on_socket_;
  Log log_;
  bool was_refused_ = false;  // the last accept failed: said once
};

}  // namespace brachy::net
