#include "apps/brachy/live/client_run.h"

#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cmath>
#include <csignal>

#include "net/access/token_file.h"

namespace brachy {

net::ClientOptions client_options_for(const ConnectOptions& daemon) {
  net::ClientOptions options;
  if (daemon.token_file) options.token = net::load_token(*daemon.token_file);
  if (daemon.tls || !daemon.tls_ca.empty() || !daemon.tls_certificate.empty())
    options.tls = net::make_client_context({daemon.tls_ca, daemon.tls_certificate, daemon.tls_key});
  return options;
}

ClientRun::ClientRun(net::ClientOptions options, net::ClientHandlers handlers)
    : client_(io_, std::move(options), wrap(std::move(handlers))) {}

net::ClientHandlers ClientRun::wrap(net::ClientHandlers handlers) {
  handlers.on_state = [this, own = std::move(handlers.on_state)](const net::StateMessage& state) {
    if (!has_state_) first_state_ = state;
    has_state_ = true;
    last_state_ = state;
    if (own) own(state);
    if (finishing_) {
      client_.close();
      io_.stop();
    }
  };
  handlers.on_error = [this, own = std::move(handlers.on_error)](const net::ErrorMessage& error) {
    if (error.code == net::ErrorCode::kShutdown)
      server_stops_ = true;
    else if (error.fatal)
      failure_ = error.text;
    if (own) own(error);
  };
  handlers.on_closed = [this](const std::string& reason) {
    if (failure_.empty() && !server_stops_) failure_ = reason;
    io_.stop();
  };
  return handlers;
}

void ClientRun::run(const ConnectOptions& server, std::optional<double> duration_s,
                    std::function<void()> regularly, std::chrono::milliseconds period) {
  client_.connect(server.host, server.port);

  boost::asio::signal_set signals(io_, SIGINT, SIGTERM);
  signals.async_wait([&](const auto& error, int) {
    if (!error) finish();
  });
  boost::asio::steady_timer end(io_), regular(io_);
  if (duration_s) {
    end.expires_after(std::chrono::nanoseconds(std::llround(*duration_s * 1e9)));
    end.async_wait([&](const auto& error) {
      if (!error) finish();
    });
  }
  regular.expires_after(period);
  std::function<void(const boost::system::error_code&)> tick = [&](const boost::system::error_code& error) {
    if (error) return;
    if (regularly) regularly();
    regular.expires_at(regular.expiry() + period);
    regular.async_wait(tick);
  };
  regular.async_wait(tick);
  io_.run();
}

void ClientRun::finish() {
  if (finishing_) return io_.stop();  // a second Ctrl-C does not wait
  finishing_ = true;
  if (client_.is_open())
    client_.request_state();
  else
    io_.stop();
}

}  // namespace brachy
