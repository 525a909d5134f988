#include "net/tcp/acceptor.h"

#include <boost/asio/error.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/socket_base.hpp>
#include <chrono>
#include <utility>

#include "core/error.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace {

constexpr std::chrono::milliseconds kRetryDelay{100};

asio::ip::tcp::endpoint checked_endpoint(const ListenOptions& options) {
  boost::system::error_code error;
  const std::string literal = options.address == "localhost" ? "127.0.0.1" : options.address;
  const auto address = asio::ip::make_address(literal, error);
  if (error) {
    throw UserError("'" + options.address + "' is not an IP address: give one such as 127.0.0.1 or ::1");
  }
  if (!address.is_loopback() && !options.allow_remote) {
    throw UserError("refusing to listen on " + options.address +
                    ": anyone who reaches it could steer the needle; use 127.0.0.1 with a tunnel, or add "
                    "--insecure-allow-remote on a network you trust");
  }
  return {address, options.port};
}

[[noreturn]] void refuse(const ListenOptions& options, const boost::system::error_code& error) {
  const std::string place = "port " + std::to_string(options.port) + " on " + options.address;
  const std::string with = " with " + options.port_option + " (0 = any free one)";
  if (error == asio::error::address_in_use) {
    throw UserError(place + " is in use: stop the program that holds it, or choose another" + with);
  }
  throw UserError("cannot listen on " + place + ": " + error.message() + "; choose another" + with);
}

}  // namespace

Acceptor::Acceptor(asio::io_context& io, const ListenOptions& options) : acceptor_(io), retry_(io) {
  const auto endpoint = checked_endpoint(options);
  boost::system::error_code error;
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (!error) port_ = acceptor_.local_endpoint(error).port();
  if (error) refuse(options, error);
}

void Acceptor::start(OnSocket on_socket, Log log) {
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
          self->on_socket_(std::move(socket));
          if (self->acceptor_.is_open()) self->accept_next();
          return;
        }
        if (!self->was_refused_) self->log_("cannot accept a connection: " + error.message() + "; trying on");
        self->was_refused_ = true;
        self->retry_.expires_after(kRetryDelay);
        self->retry_.async_wait([self](const boost::system::error_code&) {
          if (self->acceptor_.is_open()) self->accept_next();
        });
      });
}

void Acceptor::stop() {
  boost::system::error_code ignored;
  acceptor_.close(ignored);
  retry_.cancel();
}

}  // namespace brachy::net
