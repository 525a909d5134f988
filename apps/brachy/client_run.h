#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "apps/options.h"
#include "net/client.h"

namespace brachy {

/// For a client of that daemon. Throws UserError: the token file is not good, or one of TLS.
net::ClientOptions client_options_for(const ConnectOptions& daemon);

/// Runs `io` with a connected client until its time is up, Ctrl-C, or the connection ends. Before it returns for one
/// of the first two, it asks for a last STATE and waits for it, so that the counters are the newest.
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
  /// Why the server ended it; empty if we did, or the server said that it stops.
  const std::string& failure() const { return failure_; }
  bool server_stopped() const { return server_stops_; }  ///< it said that it does

 private:
  net::ClientHandlers wrap(net::ClientHandlers handlers);

  boost::asio::io_context io_{1};
  net::Client client_;
  bool has_state_ = false, finishing_ = false, server_stops_ = false;
  net::StateMessage first_state_, last_state_;
  std::string failure_;
};

}  // namespace brachy
