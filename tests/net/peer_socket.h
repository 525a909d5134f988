#pragma once

#include <openssl/ssl.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "net/transport/tls/tls_context.h"
#include "net/wire/byte_io.h"

namespace brachy::net::test {

/// A client's socket, with TLS or without, that sends any bytes at once and reads only on request.
class PeerSocket {
 public:
  /// Connects, with the address `from`. `receive_buffer` > 0 sets SO_RCVBUF. With `tls` the handshake continues in
  /// send() and take().
  PeerSocket(boost::asio::io_context& io, std::uint16_t port, int receive_buffer = 0, TlsContext tls = {},
             const std::string& from = "127.0.0.1");
  ~PeerSocket();

  /// False where the server has closed. Before the end of a handshake the bytes are queued.
  bool send(std::span<const std::byte> bytes);
  /// As send(), but beneath TLS.
  bool send_raw(std::span<const std::byte> bytes);

  using Taker = std::function<void(std::span<const std::byte>)>;
  /// Reads received data, at most `max_bytes` on the wire; returns how many.
  std::size_t take(std::size_t max_bytes, const Taker& taker);
  /// Waits until there is something to read, kTurn at most.
  void wait();

  /// Ends the stream by TLS (close_notify).
  void shutdown_tls();
  void close();

  bool is_ended() const { return is_ended_; }  ///< the server's end of the stream was read
  bool is_secure() const { return tls_ && SSL_is_init_finished(tls_.get()) == 1; }
  const std::string& failure() const { return failure_; }  ///< of TLS
  SSL* tls() { return tls_.get(); }

 private:
  void decrypt(std::span<const std::byte> bytes, const Taker& taker);
  void go_on();
  bool flush();
  void fail(int result);

  struct Free {
    void operator()(SSL* tls) const { SSL_free(tls); }
  };
  boost::asio::ip::tcp::socket socket_;
  const TlsContext context_;
  std::unique_ptr<SSL, Free> tls_;  // null: none
  Bytes waiting_;                   // for the end of the handshake
  std::string failure_;
  bool is_ended_ = false;
};

}  // namespace brachy::net::test
