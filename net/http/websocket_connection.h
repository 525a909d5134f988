#pragma once

// With http_listener.cpp, which alone includes it, one translation unit: Boost.Beast takes 18 s to compile.

#include <array>
#include <boost/asio/post.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cassert>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "net/base/clock.h"
#include "net/http/http_stream.h"
#include "net/session/server_options.h"
#include "net/transport/connection.h"
#include "net/transport/tcp/tcp_socket.h"

namespace brachy::net {
namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;

// Beast finds these by their argument.
inline void beast_close_socket(HttpStream& stream) {
  stream.close();
}
template <class Handler>
void async_teardown(beast::role_type, HttpStream& stream, Handler&& handler) {
  stream.async_shutdown_send([&stream, handler = std::forward<Handler>(handler)]() mutable {
    stream.socket().end();
    handler(boost::system::error_code());
  });
}

/// Connection over WebSocket: header and body leave as one binary message, and each message received goes to
/// on_message(). Text ends it with close code 1003, a message over max_message_bytes and a header with 1009, a
/// violation of RFC 6455 with 1002. No compression: meshes do not compress, and a peer could request much work with
/// few bytes.
class WebSocketConnection final : public Connection,
                                  public std::enable_shared_from_this<WebSocketConnection> {
 public:
  WebSocketConnection(boost::asio::io_context& io, HttpStream stream, std::string peer,
                      const ServerOptions& options)
      : peer_(std::move(peer)),
        clock_(*options.clock),
        handshake_timeout_(options.drain_timeout),
        timer_(options.clock->make_timer(io)),
        stream_(std::in_place, std::move(stream)) {
    stream_->read_message_max(options.max_message_bytes + kHeaderSize);
    stream_->auto_fragment(false);
    stream_->binary(true);
    // The session has the timeouts, and timer_ those of both handshakes.
    stream_->set_option(websocket::stream_base::timeout{websocket::stream_base::none(),
                                                        websocket::stream_base::none(), false});
  }

  /// Answers the upgrade; `handler(error)` is called once it is sent.
  template <class Request, class Handler>
  void accept(const Request& request, Handler handler) {
    limit_handshake();
    stream_->async_accept(request, [self = shared_from_this(),
                                    handler = std::move(handler)](const boost::system::error_code& error) {
      self->timer_->cancel();
      handler(error);
    });
  }

  void start(std::shared_ptr<ConnectionListener> listener) override {
    listener_ = std::move(listener);
    read();
  }

  void write(Bytes header, std::shared_ptr<const Bytes> body) override {
    assert(header_.empty());
    header_ = std::move(header);
    body_ = std::move(body);
    socket().last_progress_ns = clock_.now_ns();
    const std::array<boost::asio::const_buffer, 2> message = {
        boost::asio::buffer(header_), body_ ? boost::asio::buffer(*body_) : boost::asio::const_buffer()};
    stream_->async_write(message,
                         [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
                           self->header_.clear();
                           self->body_.reset();
                           if (!self->listener_ || (error && self->is_ending_)) return;  // end() reports it
                           if (error) return self->lost(error);
                           const auto listener = self->listener_;  // on_written may close
                           listener->on_written();
                         });
  }

  void allow_messages_of(std::size_t bytes) override {
    if (stream_) stream_->read_message_max(bytes);
  }

  void shutdown_send() override { end(websocket::close_code::normal, "closed"); }

  void close() override {
    listener_.reset();
    if (std::exchange(is_closed_, true)) return;
    timer_->cancel();
    stream_->next_layer().close();
    drop_stream(kTurns);
  }

  std::int64_t last_progress_ns() const override { return socket().last_progress_ns; }
  std::int64_t last_waited_progress_ns() const override { return socket().last_waited_progress_ns; }
  std::size_t unsent_bytes() const override { return net::unsent_bytes(socket().socket); }
  const std::string& peer() const override { return peer_; }

 private:
  MeteredSocket& socket() const { return stream_->next_layer().socket(); }

  /// Reads in pieces: Beast's reading of whole messages asserts where a close arrives within one.
  void read() {
    stream_->async_read_some(
        boost::asio::buffer(piece_),
        [self = shared_from_this()](const boost::system::error_code& error, std::size_t size) {
          if (!self->listener_) return;
          if (error) return self->lost(error);
          if (self->is_ending_) return;  // Beast's close reads the rest
          if (!self->stream_->got_binary())
            return self->end(websocket::close_code::unknown_data, "sent text; messages are binary");
          const auto piece = std::span(self->piece_).first(size);
          self->message_.insert(self->message_.end(), piece.begin(), piece.end());
          if (self->stream_->is_message_done()) {
            const auto listener = self->listener_;  // on_message may close
            listener->on_message(self->message_);
            self->message_.clear();
          }
          if (self->listener_ && !self->is_ending_) self->read();
        });
  }

  /// Sends a close frame after what is being written; the listener stays, and with it the session's timeouts.
  void end(websocket::close_code code, const char* reason) {
    if (is_ending_) return;
    is_ending_ = true;
    limit_handshake();
    stream_->async_close({code, reason},
                         [self = shared_from_this(), reason](const boost::system::error_code&) {
                           if (self->listener_) self->lost(reason);
                         });
  }

  /// Closes the socket then, which ends accept() and end(). Closed already: their handlers run.
  void limit_handshake() {
    timer_->start(handshake_timeout_, [weak = weak_from_this()] {
      const auto self = weak.lock();
      if (self && self->stream_) self->stream_->next_layer().close();
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

  /// Beast's operations may wait for each other for ever (a close that was sent, for a read that met bad UTF-8) and
  /// keep this object alive. Destroying the stream ends them; done some turns of `io` later, when the others have
  /// completed.
  void drop_stream(int turns) {
    boost::asio::post(stream_->get_executor(), [self = shared_from_this(), turns] {
      if (turns > 0) return self->drop_stream(turns - 1);
      self->stream_.reset();
    });
  }
  static constexpr int kTurns = 16;  // aborted operations take a few

  const std::string peer_;
  Clock& clock_;
  const std::chrono::milliseconds handshake_timeout_;
  const std::unique_ptr<Timer> timer_;
  mutable std::optional<websocket::stream<HttpStream, false>> stream_;  // none once closed
  std::shared_ptr<ConnectionListener> listener_;                        // null once closed
  std::array<std::byte, 4096> piece_;
  Bytes message_;  // the part received
  Bytes header_;
  std::shared_ptr<const Bytes> body_;
  bool is_ending_ = false;
  bool is_closed_ = false;
};

}  // namespace brachy::net
