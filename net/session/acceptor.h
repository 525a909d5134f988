#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "net/access/gate.h"
#include "net/base/clock.h"
#include "net/session/server_options.h"

namespace brachy::net {

/// Where to listen.
struct ListenOptions {
  std::string address = "127.0.0.1";  ///< an IP address, or localhost
  std::uint16_t port = 0;             ///< 0 = any free one
  // An address that is not loopback requires the first, or both others.
  bool allow_remote = false;           ///< without access control
  bool wants_token = false;            ///< clients need one
  bool has_tls = false;                ///< connections are encrypted
  std::string port_option = "--port";  ///< the option that chooses another port
};

/// The options of a server's listener; `port_option`: the option that chooses its port.
ListenOptions listen_options(const ServerOptions& server, std::uint16_t port, const char* port_option);

/// Whether `address`, an IP address or localhost, is reachable from this machine only. False for any other text.
bool is_loopback(const std::string& address);

/// Listens and passes on connected sockets with the slot that the gate gave each. A failed accept (no descriptors
/// left, …) is retried every 100 ms, indefinitely. Threads: the io thread.
class Acceptor : public std::enable_shared_from_this<Acceptor> {
 public:
  using OnSocket = std::function<void(boost::asio::ip::tcp::socket, std::shared_ptr<ConnectionSlot>)>;
  using Log = std::function<void(const std::string&)>;

  /// Binds and listens. Throws UserError that names the fix.
  Acceptor(boost::asio::io_context& io, TimerClock& clock, const ListenOptions& options);

  /// `entry`: how its connections become clients.
  void start(Gate& gate, Gate::Entry entry, OnSocket on_socket, Log log);
  void stop();  ///< no call of on_socket or log after it
  std::uint16_t port() const { return port_; }

 private:
  void accept_next();
  void on_accepted(boost::asio::ip::tcp::socket socket);

  boost::asio::ip::tcp::acceptor acceptor_;
  const std::unique_ptr<Timer> retry_;
  std::uint16_t port_ = 0;
  Gate* gate_ = nullptr;  // null before start()
  Gate::Entry entry_ = Gate::Entry::kHello;
  OnSocket on_socket_;
  Log log_;
  bool was_refused_ = false;  // the last accept failed; logged once
};

}  // namespace brachy::net
