#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "net/transport/tcp/metered_socket.h"
#include "net/transport/tls/handshake_turns.h"
#include "net/transport/tls/tls_stream.h"

namespace brachy::net {

/// The server's end of a TLS handshake. It reads until the ClientHello is whole, waits for its turn, and is then
/// computed away from its socket: bytes are read and written here, on the io thread, and a step between them runs on
/// the handshake thread, which has OpenSSL's object to itself until the step is done. So it may be closed at any time.
/// Threads: the io thread.
class ServerHandshake : public std::enable_shared_from_this<ServerHandshake> {
 public:
  enum class Outcome {
    kOpen,    ///< take_stream() has it
    kPlain,   ///< the peer speaks no TLS, and may be told so over socket()
    kLeft,    ///< before its handshake began
    kFailed,  ///< and the peer has the alert
  };
  /// `why`: of the last two.
  using Done = std::function<void(Outcome outcome, const std::string& why)>;

  /// `origin`: whose turn it waits for. `context` must live as long as this.
  ServerHandshake(MeteredSocket socket, boost::asio::ssl::context& context,
                  std::shared_ptr<HandshakeTurns> turns, std::string origin);
  ~ServerHandshake();

  /// Calls `done` once, never from here; its owner limits the time.
  void start(Done done);
  void close();  ///< no call of `done` after it

  MeteredSocket& socket() { return stream_ ? stream_->socket() : *plain_; }
  MeteredSocket take_socket() { return std::move(*plain_); }  ///< after kPlain
  TlsStream take_stream() { return std::move(*stream_); }     ///< after kOpen

 private:
  class Computation;

  void read();
  void on_bytes();
  bool begin();
  void compute(HandshakeTurns::Step which);
  void on_computed();
  void end(Outcome outcome, const std::string& why = "");

  boost::asio::ssl::context& context_;
  const std::shared_ptr<HandshakeTurns> turns_;
  const std::string origin_;
  Done done_;  // none once ended
  std::optional<MeteredSocket>
      plain_;  // until it begins; many of those that come in a flood never get that far
  std::optional<TlsStream> stream_;
  std::shared_ptr<Computation> computation_;
  std::vector<std::byte> read_;
  std::size_t size_ = 0;  // of what is in read_
  std::uint64_t ticket_ = 0;
};

}  // namespace brachy::net
