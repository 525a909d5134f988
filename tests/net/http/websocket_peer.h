#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "tests/net/peer_socket.h"
#include "tests/net/raw_peer.h"

namespace brachy::net::test {

/// The request that asks for the WebSocket, with a Host header of that port and `more` lines, each with its line end.
std::string upgrade_request(std::uint16_t port, const std::string& more = "");

enum class Opcode : std::uint8_t {
  kContinuation = 0,
  kText = 1,
  kBinary = 2,
  kClose = 8,
  kPing = 9,
  kPong = 10
};

/// One frame (RFC 6455, 5.2) as a client sends it.
Bytes websocket_frame(Opcode opcode, std::span<const std::byte> payload, bool is_last = true,
                      bool is_masked = true);

/// A WebSocket client, written by hand, that sends any bytes, well-formed or not, and reads only on request.
/// Expects of the server that each message is one frame and each binary one holds exactly one native message.
class WebSocketPeer : public Heard {
 public:
  /// Connects and asks for the upgrade; take() reads the answer. `receive_buffer` as RawPeer's.
  WebSocketPeer(boost::asio::io_context& io, std::uint16_t port, int receive_buffer = 0, TlsContext tls = {});

  /// Sends at once; false where the server has closed.
  bool send(std::span<const std::byte> bytes) { return socket_.send(bytes); }
  bool send_frame(Opcode opcode, std::span<const std::byte> payload) {
    return send(websocket_frame(opcode, payload));
  }
  template <class Message>
  bool send_message(const Message& message) {
    return send_frame(Opcode::kBinary, encoded(message));
  }
  /// The next message as bytes, not sent.
  template <class Message>
  Bytes encoded(const Message& message) {
    Bytes bytes;
    encode(message, ++sent_, 1, bytes);
    return bytes;
  }
  bool hello(Role role = Role::kViewer, std::uint32_t subscription = 0, std::optional<Token> token = {});

  /// Reads received data, `max_bytes` at most, and stores the messages; returns how many bytes. Never replies by
  /// itself.
  std::size_t take(std::size_t max_bytes = SIZE_MAX);
  /// take() as soon as there is something, kTurn from now at the latest: for a server in another process.
  std::size_t take_soon();
  void close() { socket_.close(); }

  bool is_open() const { return is_open_; }              ///< the upgrade was accepted
  bool is_ended() const { return socket_.is_ended(); }   ///< the server's end of the stream was read
  const std::string& answer() const { return answer_; }  ///< to the request, as far as it has come
  int close_code() const { return close_code_; }         ///< that the server sent; 0: none yet
  std::uint64_t pongs = 0;
  Bytes last_pong;

 private:
  void understand();

  PeerSocket socket_;
  std::string answer_;
  Bytes unread_;
  std::uint64_t sent_ = 0;  // sequence of the last message
  bool is_open_ = false;
  int close_code_ = 0;
};

}  // namespace brachy::net::test
