#include "net/http/http_listener.h"

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "net/access/token_file.h"
#include "net/base/clock.h"
#include "net/http/http_answer.h"
#include "net/http/websocket_connection.h"
#include "net/session/acceptor.h"
#include "net/transport/tls/server_handshake.h"
#include "net/wire/first_byte.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
namespace {

constexpr std::size_t kMaxHeaderBytes = 8 * 1024;
constexpr int kMaxRequests = 100;  // of one connection

std::string_view view(boost::beast::string_view s) {
  return {s.data(), s.size()};
}

/// The local address of the connection, as its peer sees it.
asio::ip::address address_of(const tcp::socket& socket) {
  boost::system::error_code ignored;
  const auto address = socket.local_endpoint(ignored).address();
  const bool is_mapped = address.is_v6() && address.to_v6().is_v4_mapped();
  return is_mapped ? asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6()) : address;
}

/// The answer to any request but a WebSocket upgrade on a connection that was refused.
HttpAnswer answer_of_refused_connection(const ErrorMessage& why) {
  HttpAnswer answer = refusal(503, why.text);
  answer.headers.emplace_back("Retry-After", "1");
  answer.closes = true;
  return answer;
}

/// The token of "Authorization: Bearer HEX".
std::optional<Token> bearer_token(std::string_view authorization) {
  constexpr std::string_view kScheme = "bearer ";
  const std::string scheme(authorization.substr(0, kScheme.size()));
  if (!boost::beast::iequals({scheme.data(), scheme.size()}, {kScheme.data(), kScheme.size()}))
    return std::nullopt;
  return from_hex(authorization.substr(kScheme.size()));
}

/// Shared by the connections of one listener.
struct Shared {
  Server* server;  // null once stopped
  HttpOptions options;
  ServedFiles files;
  HttpListener::Log log;
};

/// One connection, from its first byte until it ends or becomes a session of the server.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(asio::io_context& io, tcp::socket socket, std::shared_ptr<Shared> shared,
                 std::shared_ptr<ConnectionSlot> slot)
      : io_(io),
        peer_(peer_of(socket)),
        stream_(std::move(socket), *shared->server->options().clock),
        timer_(shared->server->options().clock->make_timer(io)),
        shared_(std::move(shared)),
        slot_(std::move(slot)) {
    set_up(stream_.socket().socket, shared_->server->options().send_buffer_bytes);
  }

  /// Continues with TLS or without, as configured for this port.
  void start() {
    const ServerOptions& options = shared_->server->options();
    slot_->on_shed([weak = weak_from_this()] {
      if (const auto self = weak.lock()) self->close();
    });
    close_after(options.tls ? options.hello_timeout : time_for_request());
    options.tls ? begin_handshake() : read_first();
  }

  void close() {
    timer_->cancel();
    if (handshake_) handshake_->close();
    stream_.close();
    if (websocket_) websocket_->close();
  }

 private:
  void begin_handshake() {
    handshake_ = std::make_shared<ServerHandshake>(stream_.take_socket(), *shared_->server->options().tls,
                                                   shared_->server->handshakes(), slot_->origin());
    handshake_->start([self = shared_from_this()](ServerHandshake::Outcome outcome, const std::string& why) {
      self->on_handshake(outcome, why);
    });
  }

  void on_handshake(ServerHandshake::Outcome outcome, const std::string& why) {
    const auto handshake = std::exchange(handshake_, nullptr);
    using enum ServerHandshake::Outcome;
    if (outcome == kOpen) {
      stream_.become(handshake->take_stream());
      return read();
    }
    if (outcome == kPlain) {
      stream_.become(handshake->take_socket());
      return refuse(400, "This port speaks HTTPS: open https://.");
    }
    if (outcome == kFailed) log(why);
    handshake->socket().end();  // TLS has sent the reason to the peer
    close();
  }

  void read_first() {
    unread_.resize(kMaxHeaderBytes);
    stream_.async_read_some(
        asio::buffer(unread_),
        [self = shared_from_this()](const boost::system::error_code& error, std::size_t size) {
          self->unread_.resize(size);
          self->on_first(error);
        });
  }

  void on_first(const boost::system::error_code& error) {
    if (!shared_->server) return;
    if (error) return close();
    if (static_cast<unsigned char>(unread_[0]) == kFirstByteOfTls)
      return refuse(400, "This port speaks HTTP without TLS: open http://.");
    read_header();
  }

  void read() {
    close_after(time_for_request());
    read_header();
  }

  void read_header() {
    asio::async_read_until(stream_, asio::dynamic_buffer(unread_, kMaxHeaderBytes), "\r\n\r\n",
                           [self = shared_from_this()](const boost::system::error_code& error,
                                                       std::size_t size) { self->on_header(error, size); });
  }

  void on_header(boost::system::error_code error, std::size_t size) {
    if (!shared_->server) return;
    ++requests_;
    if (error == asio::error::not_found)  // the buffer is full
      return send(refusal(431, "The header is longer than 8 KiB."), false);
    if (error) return close();
    parser_.emplace();
    const std::size_t parsed = parser_->put(asio::buffer(unread_.data(), size), error);
    if (error || !parser_->is_header_done())
      return send(refusal(400, "This is not HTTP/1.1: " + error.message() + "."), false);
    unread_.erase(0, parsed);

    // What its body's length is cannot be known.
    if (parser_->get().count(http::field::transfer_encoding) > 0 && !parser_->chunked())
      return send(refusal(501, "The only transfer coding known here is chunked."), false);

    HttpAnswer answer = answer_to(query(), shared_->files, shared_->options.pages);
    if (answer.status == 403) log(answer.text.substr(0, answer.text.size() - 1));
    if (answer.status == 101) return upgrade();  // the session sends the refusal
    // Monitoring is answered also when all slots are in use: that is when it matters.
    const auto busy = shared_->server->gate().busy(*slot_);
    if (answer.page)
      answer = page_content(*answer.page, answer.below, answer.sends_body);
    else if (busy)
      answer = answer_of_refused_connection(*busy);
    answer.closes |= busy.has_value() || answer.status == 401;
    const bool keeps_alive = parser_->get().keep_alive() && requests_ < kMaxRequests && !answer.closes;
    send(std::move(answer), keeps_alive);
  }

  HttpQuery query() {
    const auto& request = parser_->get();
    HttpQuery query;
    query.bound = address_of(stream_.socket().socket);
    query.is_tls = stream_.is_tls();
    query.method = view(request.method_string());
    query.target = view(request.target());
    if (request.count(http::field::host) == 1) query.host = view(request[http::field::host]);
    if (request.count(http::field::origin) > 0) query.origin = view(request[http::field::origin]);
    query.accept_encoding = view(request[http::field::accept_encoding]);
    query.if_none_match = view(request[http::field::if_none_match]);
    query.has_body = parser_->chunked() || parser_->content_length().value_or(0) > 0;
    query.is_upgrade = websocket::is_upgrade(request);
    return query;
  }

  HttpAnswer page_content(const DynamicPage& page, std::string_view below, bool sends_body) {
    HttpAnswer answer;
    if (const auto why = refusal_of_token(page.access)) {
      answer = refusal(401, *why);
      answer.headers.emplace_back("WWW-Authenticate", "Bearer realm=\"brachyd\"");
    } else {
      answer = page_answer(page.make ? page.make() : page.make_below(below));
    }
    answer.sends_body = sends_body;
    return answer;
  }

  std::optional<std::string> refusal_of_token(DynamicPage::Access access) {
    if (access == DynamicPage::Access::kAnyone) return std::nullopt;
    const bool is_operators = access == DynamicPage::Access::kOperator;
    const auto shown = bearer_token(view(parser_->get()[http::field::authorization]));
    const auto why = shared_->server->gate().refusal(shown, is_operators ? Role::kOperator : Role::kViewer);
    return why ? std::optional(why->text) : std::nullopt;
  }

  void send(HttpAnswer answer, bool keeps_alive) {
    answer_ = std::move(answer);
    response_.emplace();
    response_->result(static_cast<unsigned>(answer_.status));
    for (const auto& [name, value] : answer_.headers) response_->set(name, value);
    response_->keep_alive(keeps_alive);
    const std::string_view body = answer_.body();
    if (answer_.status != 204 && answer_.status != 304) response_->content_length(body.size());
    if (answer_.sends_body) response_->body() = {body.data(), body.size()};
    close_after(shared_->options.answer_timeout);
    http::async_write(
        stream_, *response_,
        [self = shared_from_this(), keeps_alive](const boost::system::error_code& error, std::size_t) {
          if (error || !self->shared_->server) return self->close();
          if (keeps_alive) return self->read();
          self->close_after(self->shared_->server->options().drain_timeout);
          self->stream_.async_shutdown_send([self] { self->drain(); });
        });
  }

  void refuse(int status, const char* text) {
    log(text);
    send(refusal(status, text), false);
  }

  void log(const std::string& why) { shared_->log("http: " + peer_ + " refused: " + why); }

  /// While no slot is free there is less time: a connection can be answered only by a page.
  std::chrono::milliseconds time_for_request() const {
    return shared_->server->gate().busy(*slot_) ? shared_->server->options().hello_timeout
                                                : shared_->options.request_timeout;
  }

  /// Closes the connection then, unless another time is set before.
  void close_after(std::chrono::milliseconds time) {
    timer_->start(time, [weak = weak_from_this()] {
      if (const auto self = weak.lock()) self->close();
    });
  }

  /// Reads and discards further input for a moment: closing at once could destroy the answer before the peer reads it.
  void drain() {
    unread_.resize(kMaxHeaderBytes);
    stream_.socket().async_read_some(
        asio::buffer(unread_),
        [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
          error ? self->close() : self->drain();
        });
  }

  void upgrade() {
    if (!unread_.empty())
      return send(refusal(400, "Frames may follow only after the answer to the upgrade."), false);
    timer_->cancel();
    websocket_ =
        std::make_shared<WebSocketConnection>(io_, std::move(stream_), peer_, shared_->server->options());
    websocket_->accept(parser_->get(), [self = shared_from_this()](const boost::system::error_code& error) {
      const auto connection = std::exchange(self->websocket_, nullptr);
      if (error || !self->shared_->server) return connection->close();
      self->shared_->server->adopt(connection, self->slot_);
    });
  }

  asio::io_context& io_;
  const std::string peer_;
  HttpStream stream_;
  const std::unique_ptr<Timer> timer_;
  const std::shared_ptr<Shared> shared_;
  const std::shared_ptr<ConnectionSlot> slot_;
  std::shared_ptr<WebSocketConnection> websocket_;  // while the upgrade is being answered
  std::shared_ptr<ServerHandshake> handshake_;      // until TLS is open
  std::string unread_;  // at most a header: Beast's own header_limit() does not count lines already parsed
  std::optional<http::request_parser<http::empty_body>> parser_;
  HttpAnswer answer_;
  std::optional<http::response<http::span_body<const char>>> response_;  // into answer_
  int requests_ = 0;
};

}  // namespace

class HttpListener::Impl {
 public:
  Impl(asio::io_context& io, Server& server, HttpOptions options, ServedFiles files, Log log)
      : io_(io),
        shared_(std::make_shared<Shared>(Shared{&server, options, std::move(files), std::move(log)})),
        acceptor_(std::make_shared<Acceptor>(
            io, *server.options().clock, listen_options(server.options(), options.port, "--http-port"))) {}

  void start() {
    acceptor_->start(
        shared_->server->gate(), Gate::Entry::kRequest,
        [this](tcp::socket socket, auto slot) { on_socket(std::move(socket), std::move(slot)); },
        [this](const std::string& line) { shared_->log("http: " + line); });
  }

  void stop() {
    acceptor_->stop();
    shared_->server = nullptr;
    for (const auto& connection : std::exchange(connections_, {}))
      if (const auto alive = connection.lock()) alive->close();
  }

  std::uint16_t port() const { return acceptor_->port(); }

 private:
  void on_socket(tcp::socket socket, std::shared_ptr<ConnectionSlot> slot) {
    std::erase_if(connections_, [](const auto& connection) { return connection.expired(); });
    const auto connection =
        std::make_shared<HttpConnection>(io_, std::move(socket), shared_, std::move(slot));
    connections_.push_back(connection);
    connection->start();
  }

  asio::io_context& io_;
  const std::shared_ptr<Shared> shared_;
  const std::shared_ptr<Acceptor> acceptor_;
  std::vector<std::weak_ptr<HttpConnection>> connections_;  // those that are not sessions yet
};

HttpListener::HttpListener(asio::io_context& io, Server& server, HttpOptions options, ServedFiles files,
                           Log log)
    : impl_(std::make_unique<Impl>(io, server, options, std::move(files), std::move(log))) {
  impl_->start();
}

HttpListener::~HttpListener() {
  impl_->stop();
}

std::uint16_t HttpListener::port() const {
  return impl_->port();
}

void HttpListener::stop() {
  impl_->stop();
}

}  // namespace brachy::net
