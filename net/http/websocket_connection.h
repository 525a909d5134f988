#pragma once

// With http_listener.cpp, which alone includes it, one translation unit: Boost.Beast takes 18 s to compile.

#include <array>
#include <boost/asio/compose.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cassert>
#include <memory>
#include <string>
#include <utility>

#include "net/clock.h"
#include "net/connection.h"
#include "net/server_options.h"
#include "net/tcp/tcp_socket.h"

namespace brachy::net {
namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;

/// A socket as Beast's WebSocket stream wants it, which notes when it gets rid of bytes.
struct MeteredSocket {
  using executor_type = boost::asio::ip::tcp::socket::executor_type;
  executor_type get_executor() { return socket.get_executor(); }

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return socket.async_read_some(buffers, std::forward<Handler>(handler));
  }

  /// Writes at once if there is room, else once there is, so that it knows a peer that had to be waited for.
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    enum class Step { kTry, kWaited, kPosted };
    return boost::asio::async_compose<Handler, void(boost::system::error_code, std::size_t)>(
        [this, buffers, step = Step::kTry, size = std::size_t{0}, result = boost::system::error_code()](
            auto& self, boost::system::error_code error = {}) mutable {
          if (step == Step::kPosted) return self.complete(result, size);
          if (!error) size = socket.write_some(buffers, error);
          if (error == boost::asio::error::would_block || error == boost::asio::error::try_again) {
            step = Step::kWaited;
            return socket.async_wait(socket.wait_write, std::move(self));
          }
          if (size > 0) {
            last_progress_ns = monotonic_ns();
            if (was_full || step == Step::kWaited) last_waited_progress_ns = last_progress_ns;
            was_full = size < boost::asio::buffer_size(buffers);
          }
          if (step == Step::kWaited) return self.complete(error, size);
          step = Step::kPosted;
          result = error;
          boost::asio::post(socket.get_executor(), std::move(self));
        },
        handler, socket);
  }

  /// Closes, without waiting for the peer to do so. What it sent is read first: with bytes unread, Linux takes back what
  /// has not reached the peer, the close frame too.
  void end() {
    boost::system::error_code error;
    socket.shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
    std::array<char, 16 * 1024> ignored;
    for (int i = 0; i < 64 && !error; ++i) socket.read_some(boost::asio::buffer(ignored), error);
    socket.close(error);
  }

  boost::asio::ip::tcp::socket socket;
  std::int64_t last_progress_ns = 0;
  std::int64_t last_waited_progress_ns = 0;
  bool was_full = false;  // the last write found no room for all of it
};

// Beast finds these by their argument.
inline void beast_close_socket(MeteredSocket& stream) {
  boost::system::error_code ignored;
  stream.socket.close(ignored);
}
template <class Handler>
void async_teardown(beast::role_type, MeteredSocket& stream, Handler&& handler) {
  stream.end();
  boost::asio::post(stream.get_executor(),
                    beast::bind_front_handler(std::forward<Handler>(handler), boost::system::error_code()));
}

/// Connection over WebSocket: header and body leave as one binary message, and each message that comes goes to
/// on_message(). Text ends it with close code 1003, a message over max_message_bytes and a header with 1009, whatever
/// breaks RFC 6455 with 1002. Nothing is compressed: mesh does not shrink, and a peer could ask for much with little.
class WebSocketConnection final : public Connection,
                                  public std::enable_shared_from_this<WebSocketConnection> {
 public:
  WebSocketConnection(boost::asio::ip::tcp::socket socket, const ServerOptions& options)
      : peer_(peer_of(socket)), stream_(MeteredSocket{std::move(socket)}) {
    set_up(stream_.next_layer().socket, options.send_buffer_bytes);
    stream_.read_message_max(options.max_message_bytes + kHeaderSize);
    stream_.auto_fragment(false);
    stream_.binary(true);
    // The session has the timeouts; this one is for how long a close may take.
    stream_.set_option(
        websocket::stream_base::timeout{options.drain_timeout, websocket::stream_base::none(), false});
  }

  /// Answers the upgrade; `handler(error)` comes once that has left.
  template <class Request, class Handler>
  void accept(const Request& request, Handler handler) {
    stream_.async_accept(request, [self = shared_from_this(), handler = std::move(handler)](
                                      const boost::system::error_code& error) { handler(error); });
  }

  void start(std::shared_ptr<ConnectionListener> listener) override {
    listener_ = std::move(listener);
    read();
  }

  void write(Bytes header, std::shared_ptr<const Bytes> body) override {
    assert(header_.empty());
    header_ = std::move(header);
    body_ = std::move(body);
    stream_.next_layer().last_progress_ns = monotonic_ns();
    const std::array<boost::asio::const_buffer, 2> message = {
        boost::asio::buffer(header_), body_ ? boost::asio::buffer(*body_) : boost::asio::const_buffer()};
    stream_.async_write(message,
                        [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
                          self->header_.clear();
                          self->body_.reset();
                          if (!self->listener_ || (error && self->is_ending_)) return;  // end() tells
                          if (error) return self->lost(error);
                          const auto listener = self->listener_;  // on_written may close
                          listener->on_written();
                        });
  }

  void shutdown_send() override { end(websocket::close_code::normal, "closed"); }

  void close() override {
    listener_.reset();
    boost::system::error_code ignored;
    stream_.next_layer().socket.close(ignored);
  }

  std::int64_t last_progress_ns() const override { return stream_.next_layer().last_progress_ns; }
  std::int64_t last_waited_progress_ns() const override {
    return stream_.next_layer().last_waited_progress_ns;
  }
  std::size_t unsent_bytes() const override { return net::unsent_bytes(stream_.next_layer().socket); }
  const std::string& peer() const override { return peer_; }

 private:
  void read() {
    stream_.async_read(
        buffer_, [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
          if (!self->listener_) return;
          if (error) return self->lost(error);
          if (!self->stream_.got_binary())
            return self->end(websocket::close_code::unknown_data, "sent text; messages are binary");
          const auto listener = self->listener_;  // on_message may close
          const auto data = self->buffer_.cdata();
          listener->on_message({static_cast<const std::byte*>(data.data()), data.size()});
          self->buffer_.consume(self->buffer_.size());
          if (self->listener_) self->read();
        });
  }

  /// Sends a close frame after what is being written; the listener stays, and with it the session's timeouts.
  void end(websocket::close_code code, const char* reason) {
    if (is_ending_) return;
    is_ending_ = true;
    stream_.async_close({code, reason},
                        [self = shared_from_this(), reason](const boost::system::error_code&) {
                          if (self->listener_) self->lost(reason);
                        });
  }

  void lost(const boost::system::error_code& error) {
    if (error == websocket::error::closed || error == boost::asio::error::eof)
      return lost("closed by the peer");
    lost(error.message());
  }
  void lost(const std::string& reason) {
    const auto listener = std::exchange(listener_, nullptr);
    close();
    listener->on_closed(reason);
  }

  const std::string peer_;
  mutable websocket::stream<MeteredSocket, false> stream_;  // native_handle() is not const
  std::shared_ptr<ConnectionListener> listener_;            // null once closed
  beast::flat_buffer buffer_;
  Bytes header_;
  std::shared_ptr<const Bytes> body_;
  bool is_ending_ = false;
};

}  // namespace brachy::net
