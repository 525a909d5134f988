#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "apps/command_line/option_groups.h"
#include "net/client/client.h"

namespace brachy {

/// Client options for that daemon. Throws UserError: the token file or a file of TLS is invalid.
net::ClientOptions client_options_for(const ConnectOptions& daemon);

/// Runs `io` with a connected client until its time is up, Ctrl-C, or the connection ends. Before it returns for one
/// of the first two, it requests a last STATE and waits for it, so that the counters are the newest.
/// One thread, the caller's.
class ClientRun {
 public:
  /// `handlers` are the tool's own; their on_state, on_error and on_closed are called too.
  ClientRun(net::ClientOptions options, net::ClientHandlers handlers);

  /// Connects (UserError if nothing listens) and runs. `regularly` is called every `period` if given.
  void run(const ConnectOptions& server, std::optional<double> duration_s,
           std::function<void()> regularly = {}, std::chrono::milliseconds period = std::chrono::seconds(1));

  /// Ends run() from a handler.
  void finish();

  boost::asio::io_context& io() { return io_; }
  net::Client& client() { return client_; }
  const net::Client& client() const { return client_; }
  const net::StateMessage& first_state() const { return first_state_; }
  const net::StateMessage& last_state() const { return last_state_; }
  /// Why the server closed the connection; empty if this client did, or the server announced its shutdown.
  const std::string& failure() const { return failure_; }
  bool server_stopped() const { return server_stops_; }  ///< it announced its shutdown

 private:
  net::ClientHandlers wrap(net::ClientHandlers handlers);

  boost::asio::io_context io_{1};
  net::Client client_;
  bool has_state_ = false, finishing_ = false, server_stops_ = false;
  net::StateMessage first_state_, last_state_;
  std::string failure_;
};

}  // namespace brachy
