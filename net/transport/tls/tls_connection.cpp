#include "net/transport/tls/tls_connection.h"

#include <openssl/x509v3.h>

#include <array>
#include <boost/asio/error.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/write.hpp>
#include <cassert>

#include "net/transport/tcp/tcp_socket.h"
#include "net/transport/tls/tls_failure.h"
#include "net/wire/codec.h"

namespace brachy::net {
namespace asio = boost::asio;

TlsConnection::TlsConnection(End end, Clock& clock, std::string peer, std::size_t read_buffer_bytes)
    : end_(end), clock_(clock), peer_(std::move(peer)), read_buffer_(read_buffer_bytes) {}

std::shared_ptr<TlsConnection> TlsConnection::at_server(asio::ip::tcp::socket socket, Clock& clock,
                                                        asio::ssl::context& context,
                                                        std::shared_ptr<HandshakeTurns> turns,
                                                        const std::string& origin, int send_buffer_bytes,
                                                        std::size_t read_buffer_bytes) {
  std::shared_ptr<TlsConnection> connection(
      new TlsConnection(End::kServer, clock, peer_of(socket), read_buffer_bytes));
  set_up(socket, send_buffer_bytes);
  connection->handshake_ = std::make_shared<ServerHandshake>(MeteredSocket{std::move(socket), &clock},
                                                             context, std::move(turns), origin);
  return connection;
}

std::shared_ptr<TlsConnection> TlsConnection::at_client(asio::ip::tcp::socket socket, Clock& clock,
                                                        asio::ssl::context& context, const std::string& host,
                                                        int send_buffer_bytes,
                                                        std::size_t read_buffer_bytes) {
  std::shared_ptr<TlsConnection> connection(
      new TlsConnection(End::kClient, clock, peer_of(socket), read_buffer_bytes));
  set_up(socket, send_buffer_bytes);
  connection->stream_.emplace(MeteredSocket{std::move(socket), &clock}, context);
  SSL* tls = connection->stream_->handle();
  boost::system::error_code is_name;
  asio::ip::make_address(host, is_name);
  if (is_name) {
    SSL_set_tlsext_host_name(tls, host.c_str());
    SSL_set1_host(tls, host.c_str());
  } else {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(tls), host.c_str());
  }
  return connection;
}

void TlsConnection::start(std::shared_ptr<ConnectionListener> listener) {
  listener_ = std::move(listener);
  const auto self = shared_from_this();
  if (handshake_)
    return handshake_->start([self](ServerHandshake::Outcome outcome, const std::string& why) {
      self->on_handshake(outcome, why);
    });
  stream_->async_connect([self](const boost::system::error_code& error) {
    if (!self->listener_) return;
    error ? self->lost(error) : self->open();
  });
}

void TlsConnection::on_handshake(ServerHandshake::Outcome outcome, const std::string& why) {
  switch (outcome) {
    case ServerHandshake::Outcome::kOpen:
      stream_.emplace(handshake_->take_stream());
      handshake_.reset();
      return open();
    case ServerHandshake::Outcome::kPlain:
      return answer_plain();
    case ServerHandshake::Outcome::kLeft:
    case ServerHandshake::Outcome::kFailed:
      return lost(why);
  }
}

void TlsConnection::answer_plain() {
  Bytes answer;
  encode(ErrorMessage{ErrorCode::kProtocol, true, 0, 0, "this server speaks TLS: add --tls"}, 1,
         clock_.now_ns(), answer);
  boost::system::error_code ignored;
  socket().socket.write_some(asio::buffer(answer), ignored);
  lost("it speaks no TLS, and this port takes nothing else");
}

void TlsConnection::open() {
  phase_ = Phase::kOpen;
  if (!header_.empty()) write_all();
  read_some();
}

void TlsConnection::read_some() {
  stream_->async_read_some(
      asio::buffer(read_buffer_),
      [self = shared_from_this()](const boost::system::error_code& error, std::size_t size) {
        if (!self->listener_) return;
        if (error && self->phase_ == Phase::kEnding) return;  // shutdown_send() goes on
        if (error) return self->lost(error);
        const auto listener = self->listener_;  // on_bytes may close
        listener->on_bytes(std::span<const std::byte>(self->read_buffer_).first(size));
        if (self->listener_) self->read_some();
      });
}

void TlsConnection::write(Bytes header, std::shared_ptr<const Bytes> body) {
  assert(header_.empty());
  header_ = std::move(header);
  body_ = std::move(body);
  socket().last_progress_ns = clock_.now_ns();
  if (phase_ == Phase::kOpen) write_all();
}

void TlsConnection::write_all() {
  const std::array<asio::const_buffer, 2> message = {asio::buffer(header_),
                                                     body_ ? asio::buffer(*body_) : asio::const_buffer()};
  asio::async_write(*stream_, message,
                    [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
                      self->header_.clear();
                      self->body_.reset();
                      // The peer may have sent the reason: read_some() reports it.
                      if (!self->listener_ || error) return;
                      const auto listener = self->listener_;  // on_written may close
                      listener->on_written();
                    });
}

std::size_t TlsConnection::unsent_bytes() const {
  return net::unsent_bytes(socket().socket);
}

void TlsConnection::shutdown_send() {
  if (phase_ != Phase::kOpen) return;
  phase_ = Phase::kEnding;
  stream_->async_shutdown([self = shared_from_this()](const boost::system::error_code&) {
    if (!self->listener_) return;
    boost::system::error_code ignored;
    self->socket().socket.shutdown(asio::socket_base::shutdown_send, ignored);
    self->drain();
  });
}

/// Reads and discards further input, without decrypting it, until the peer has left: closing before could destroy our
/// last message before the peer reads it.
void TlsConnection::drain() {
  socket().async_read_some(asio::buffer(read_buffer_),
                           [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
                             if (!self->listener_) return;
                             error ? self->lost("closed by the peer") : self->drain();
                           });
}

void TlsConnection::close() {
  listener_.reset();
  if (handshake_) return handshake_->close();
  boost::system::error_code ignored;
  socket().socket.close(ignored);
}

void TlsConnection::lost(const boost::system::error_code& error) {
  const bool is_end = error == asio::error::eof || error == asio::ssl::error::stream_truncated;
  if (is_end && phase_ == Phase::kOpen) return lost("closed by the peer");
  if (phase_ == Phase::kOpen && error.category() != asio::error::get_ssl_category())
    return lost(error.message());
  lost(end_ == End::kServer ? failure_with_client(error, stream_->handle())
                            : failure_with_server(error, stream_->handle()));
}

void TlsConnection::lost(const std::string& reason) {
  const auto listener = std::exchange(listener_, nullptr);
  socket().end();  // the last record still has to reach the peer
  listener->on_closed(reason);
}

}  // namespace brachy::net
