#include "net/session/acceptor.h"

#include <boost/asio/error.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/socket_base.hpp>
#include <chrono>
#include <utility>

#include "core/base/error.h"
#include "net/transport/tcp/tcp_socket.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace {

constexpr std::chrono::milliseconds kRetryDelay{100};

/// The keys of the scene file that a remote address requires and that are not set.
std::string missing_for_remote(const ListenOptions& options) {
  constexpr const char* kToken = "server.token_file (`brachy token FILE` makes one)";
  constexpr const char* kTls = "server.tls_certificate and server.tls_key";
  if (options.wants_token) return options.has_tls ? "" : kTls;
  return options.has_tls ? kToken : std::string(kToken) + " and " + kTls;
}

asio::ip::address parsed(const std::string& address, boost::system::error_code& error) {
  return asio::ip::make_address(address == "localhost" ? "127.0.0.1" : address, error);
}

asio::ip::tcp::endpoint checked_endpoint(const ListenOptions& options) {
  boost::system::error_code error;
  const auto address = parsed(options.address, error);
  if (error) {
    throw UserError("'" + options.address + "' is not an IP address: give one such as 127.0.0.1 or ::1");
  }
  if (!address.is_loopback() && !options.allow_remote) {
    const std::string missing = missing_for_remote(options);
    if (!missing.empty())
      throw UserError("refusing to listen on " + options.address +
                      ": anyone who reaches it could steer the needle; set " + missing +
                      ", use 127.0.0.1 with a tunnel, or add --insecure-allow-remote on a network you trust");
  }
  return {address, options.port};
}

[[noreturn]] void refuse(const ListenOptions& options, const boost::system::error_code& error) {
  const std::string endpoint = "port " + std::to_string(options.port) + " on " + options.address;
  const std::string with = " with " + options.port_option + " (0 = any free one)";
  if (error == asio::error::address_in_use) {
    throw UserError(endpoint + " is in use: stop the program that holds it, or choose another" + with);
  }
  throw UserError("cannot listen on " + endpoint + ": " + error.message() + "; choose another" + with);
}

}  // namespace

ListenOptions listen_options(const ServerOptions& server, std::uint16_t port, const char* port_option) {
  return {server.address,        port,       server.allow_remote, !server.tokens.is_empty(),
          server.tls != nullptr, port_option};
}

bool is_loopback(const std::string& address) {
  boost::system::error_code error;
  return parsed(address, error).is_loopback() && !error;
}

Acceptor::Acceptor(asio::io_context& io, TimerClock& clock, const ListenOptions& options)
    : acceptor_(io), retry_(clock.make_timer(io)) {
  const auto endpoint = checked_endpoint(options);
  boost::system::error_code error;
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (!error) port_ = acceptor_.local_endpoint(error).port();
  if (error) refuse(options, error);
}

void Acceptor::start(Gate& gate, Gate::Entry entry, OnSocket on_socket, Log log) {
  gate_ = &gate;
  entry_ = entry;
  on_socket_ = std::move(on_socket);
  log_ = std::move(log);
  accept_next();
}

void Acceptor::accept_next() {
  acceptor_.async_accept(
      [self = shared_from_this()](const boost::system::error_code& error, asio::ip::tcp::socket socket) {
        if (!self->acceptor_.is_open()) return;
        if (!error) {
          self->was_refused_ = false;
          self->on_accepted(std::move(socket));
          if (self->acceptor_.is_open()) self->accept_next();
          return;
        }
        if (!self->was_refused_) self->log_("cannot accept a connection: " + error.message() + "; retrying");
        self->was_refused_ = true;
        self->retry_->start(kRetryDelay, [self] {
          if (self->acceptor_.is_open()) self->accept_next();
        });
      });
}

void Acceptor::on_accepted(asio::ip::tcp::socket socket) {
  const std::string address = address_of_peer(socket);
  auto slot = gate_->acquire_slot(address, entry_);
  if (slot) return on_socket_(std::move(socket), std::move(slot));
  log_("connection from " + address + " closed: too many are being refused");
}

void Acceptor::stop() {
  boost::system::error_code ignored;
  acceptor_.close(ignored);
  retry_->cancel();
}

}  // namespace brachy::net
