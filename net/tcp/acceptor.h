#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "net/server_options.h"

namespace brachy::net {

/// Listens and hands over connected sockets. An accept that fails (no descriptors left, …) is tried again after
/// 100 ms, for ever. Threads: the io thread.
class Acceptor : public std::enable_shared_from_this<Acceptor> {
 public:
  using OnSocket = std::function<void(boost::asio::ip::tcp::socket)>;
  using Log = std::function<void(const std::string&)>;

  /// Binds and listens. Throws UserError that names the fix.
  Acceptor(boost::asio::io_context& io, const ServerOptions& options);

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
