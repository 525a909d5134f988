#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "net/http/http_listener.h"
#include "tests/net/http/websocket_peer.h"
#include "tests/net/net_testing.h"

namespace brachy::net::test {

/// A temporary directory, removed by the destructor.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  void write(const std::string& name, const std::string& content) const;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct HttpReply {
  int status = 0;
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
};

/// An HTTP client that sends any text and reads only on request.
class HttpPeer {
 public:
  HttpPeer(boost::asio::io_context& io, std::uint16_t port, TlsContext tls = {})
      : socket_(io, port, 0, std::move(tls)) {}
  bool send(const std::string& text) {
    return socket_.send(std::as_bytes(std::span(text)));
  }             ///< at once; false where the server has closed
  void take();  ///< reads what has come
  /// Takes the first reply out of what was read; false where it is not complete. `to_head`: it has no body.
  bool next(HttpReply& reply, bool to_head = false);
  bool is_ended() const { return socket_.is_ended(); }
  PeerSocket& socket() { return socket_; }

 private:
  PeerSocket socket_;
  std::string unread_;
};

/// A server with an HTTP listener on a free port of the loopback, all on one io_context.
struct HttpFixture : ServerFixture {
  void start_http(ServerOptions options = {}, HttpOptions http_options = {}, ServedFiles files = {});
  std::string host_line() const { return "Host: 127.0.0.1:" + std::to_string(http->port()) + "\r\n"; }
  /// The reply to "GET target" with a valid Host and `more` lines, each with its line end. Fails the test without one.
  HttpReply get(const std::string& target, const std::string& more = "", const std::string& method = "GET");
  /// The reply to the whole `request`; status 0: nothing came before the end.
  HttpReply ask(const std::string& request, bool to_head = false);
  bool ends(HttpPeer& peer);  ///< the server ends the connection; what it says before is left unread

  /// A page, past its upgrade; and welcomed too, or refused.
  std::unique_ptr<WebSocketPeer> open_page(int receive_buffer = 0);
  std::unique_ptr<WebSocketPeer> join_page(Role role = Role::kViewer, std::uint32_t subscription = 0);
  bool ends(WebSocketPeer& page);

  std::unique_ptr<HttpListener> http;
  TlsContext tls;  ///< of the peers made here; none: they speak none
};

}  // namespace brachy::net::test
