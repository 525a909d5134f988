#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "net/base/clock.h"
#include "net/transport/connection.h"
#include "net/transport/tls/server_handshake.h"
#include "net/transport/tls/tls_stream.h"

namespace brachy::net {

/// Connection over TLS over TCP, either end. The handshake begins with start(); what is written before its end waits
/// for it. Who shows the server a wrong certificate, or does anything but TLS, is on_closed() with the reason; a peer
/// that does nothing is left to the owner's timeouts. At the server a handshake waits for its turn (HandshakeTurns).
class TlsConnection final : public Connection, public std::enable_shared_from_this<TlsConnection> {
 public:
  static std::shared_ptr<TlsConnection> at_server(boost::asio::ip::tcp::socket socket, Clock& clock,
                                                  boost::asio::ssl::context& context,
                                                  std::shared_ptr<HandshakeTurns> turns,
                                                  const std::string& origin, int send_buffer_bytes,
                                                  std::size_t read_buffer_bytes);
  /// `host` is the name or address that the server's certificate must hold.
  static std::shared_ptr<TlsConnection> at_client(boost::asio::ip::tcp::socket socket, Clock& clock,
                                                  boost::asio::ssl::context& context, const std::string& host,
                                                  int send_buffer_bytes, std::size_t read_buffer_bytes);

  void start(std::shared_ptr<ConnectionListener> listener) override;
  void write(Bytes header, std::shared_ptr<const Bytes> body) override;
  void shutdown_send() override;
  void close() override;
  std::int64_t last_progress_ns() const override { return socket().last_progress_ns; }
  std::int64_t last_waited_progress_ns() const override { return socket().last_waited_progress_ns; }
  std::size_t unsent_bytes() const override;
  const std::string& peer() const override { return peer_; }

 private:
  enum class End { kServer, kClient };
  enum class Phase { kHandshake, kOpen, kEnding };

  TlsConnection(End end, Clock& clock, std::string peer, std::size_t read_buffer_bytes);
  MeteredSocket& socket() const { return handshake_ ? handshake_->socket() : stream_->socket(); }

  void on_handshake(ServerHandshake::Outcome outcome, const std::string& why);
  void answer_plain();
  void open();
  void read_some();
  void write_all();
  void drain();
  void lost(const boost::system::error_code& error);
  void lost(const std::string& reason);

  const End end_;
  Clock& clock_;
  // One of both is set: at the server first the handshake. Asio's accessors are not const.
  std::shared_ptr<ServerHandshake> handshake_;
  mutable std::optional<TlsStream> stream_;
  const std::string peer_;
  Phase phase_ = Phase::kHandshake;
  std::shared_ptr<ConnectionListener> listener_;  // null once closed
  std::vector<std::byte> read_buffer_;
  Bytes header_;  // empty: nothing is being written
  std::shared_ptr<const Bytes> body_;
};

}  // namespace brachy::net
