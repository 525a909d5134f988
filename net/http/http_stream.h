#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <utility>
#include <variant>

#include "net/transport/tcp/metered_socket.h"
#include "net/transport/tls/tls_stream.h"

namespace brachy::net {

/// The stream under an HTTP connection: a socket, or TLS over one. One type for both, since Boost.Beast takes many
/// seconds to compile for each.
class HttpStream {
 public:
  using executor_type = MeteredSocket::executor_type;

  HttpStream(boost::asio::ip::tcp::socket socket, Clock& clock)
      : stream_(MeteredSocket{std::move(socket), &clock}) {}

  executor_type get_executor() { return socket().get_executor(); }
  MeteredSocket& socket() {
    auto* plain = std::get_if<MeteredSocket>(&stream_);
    return plain ? *plain : std::get<TlsStream>(stream_).socket();
  }
  bool is_tls() const { return std::holds_alternative<TlsStream>(stream_); }

  /// The socket, for a handshake; afterwards become() the stream that it made, or the socket again.
  MeteredSocket take_socket() { return std::move(std::get<MeteredSocket>(stream_)); }
  template <class Stream>
  void become(Stream stream) {
    stream_.emplace<Stream>(std::move(stream));
  }

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    if (auto* tls = std::get_if<TlsStream>(&stream_))
      return tls->async_read_some(buffers, std::forward<Handler>(handler));
    return std::get<MeteredSocket>(stream_).async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    if (auto* tls = std::get_if<TlsStream>(&stream_))
      return tls->async_write_some(buffers, std::forward<Handler>(handler));
    return std::get<MeteredSocket>(stream_).async_write_some(buffers, std::forward<Handler>(handler));
  }

  /// The peer reads the end of the stream. `handler()`; over TLS once the peer has answered, or left.
  template <class Handler>
  void async_shutdown_send(Handler handler) {
    auto shut = [this, handler = std::move(handler)](const boost::system::error_code& = {}) mutable {
      boost::system::error_code ignored;
      socket().socket.shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
      handler();
    };
    if (auto* tls = std::get_if<TlsStream>(&stream_)) return tls->async_shutdown(std::move(shut));
    boost::asio::post(get_executor(), std::move(shut));
  }

  void close() {
    boost::system::error_code ignored;
    socket().socket.close(ignored);
  }

 private:
  std::variant<MeteredSocket, TlsStream> stream_;
};

}  // namespace brachy::net
