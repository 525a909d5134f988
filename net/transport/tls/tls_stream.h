#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <string>
#include <utility>
#include <vector>

#include "net/transport/tcp/metered_socket.h"

namespace brachy::net {

/// TLS over a socket, for Asio's and Beast's composed operations. A write makes one record of as much as fits, and
/// completes when the record is passed to the system: nothing is buffered here between writes. A write that would
/// block is retried with the same bytes. Must not be moved while an operation runs. Threads: the io thread.
class TlsStream {
 public:
  using executor_type = MeteredSocket::executor_type;

  TlsStream(MeteredSocket socket, boost::asio::ssl::context& context)
      : stream_(std::move(socket), context), record_(kRecordBytes) {}

  executor_type get_executor() { return stream_.get_executor(); }
  MeteredSocket& socket() { return stream_.next_layer(); }
  SSL* handle() { return stream_.native_handle(); }

  /// The handshake as client; a server's is ServerHandshake.
  template <class Handler>
  void async_connect(Handler handler) {
    stream_.async_handshake(boost::asio::ssl::stream_base::client, std::move(handler));
  }

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return stream_.async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    const std::size_t size = boost::asio::buffer_copy(boost::asio::buffer(record_), buffers);
    return stream_.async_write_some(boost::asio::buffer(record_, size), std::forward<Handler>(handler));
  }

  /// Sends close_notify, and waits for the peer's or for its end. `handler(error)`.
  template <class Handler>
  void async_shutdown(Handler handler) {
    stream_.async_shutdown(std::move(handler));
  }

 private:
  static constexpr std::size_t kRecordBytes = 16 * 1024;  // TLS's maximum

  boost::asio::ssl::stream<MeteredSocket> stream_;
  std::vector<std::byte> record_;  // being written: Asio would send only the first of several buffers
};

}  // namespace brachy::net
