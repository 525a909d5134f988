#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "net/wire/frame_assembler.h"
#include "net/wire/message_parser.h"
#include "tests/net/peer_socket.h"

namespace brachy::net::test {

/// Messages that a peer received from a server.
struct Heard {
  std::vector<MessageType> types;
  std::vector<FrameMessage> frames;
  std::vector<Bytes> frame_bodies;
  std::vector<ErrorMessage> errors;
  std::vector<StateMessage> states;
  std::vector<EventMessage> events;
  std::vector<ForceMessage> forces;
  std::vector<ImageMessage> images;
  std::vector<LocalModelMessage> models;
  FrameAssembler mesh;

  /// Of the fatal ERROR that came, 0 without.
  ErrorCode fatal() const { return fatal_; }

 protected:
  /// The next bytes of the stream.
  void hear(std::span<const std::byte> bytes);

 private:
  void keep(const MessageParser::Message& message);

  MessageParser parser_{64u << 20};
  ErrorCode fatal_{};
};

/// A peer that sends any bytes, well-formed or not, and reads only on request.
class RawPeer : public Heard {
 public:
  /// `receive_buffer` > 0 sets SO_RCVBUF, so that a peer that does not read soon blocks the server. `from`: its
  /// address.
  RawPeer(boost::asio::io_context& io, std::uint16_t port, int receive_buffer = 0, TlsContext tls = {},
          const std::string& from = "127.0.0.1")
      : socket_(io, port, receive_buffer, std::move(tls), from) {}

  /// Sends at once; false where the server has closed.
  bool send(std::span<const std::byte> bytes) { return socket_.send(bytes); }
  template <class Message>
  bool send_message(const Message& message) {
    Bytes bytes;
    encode(message, ++sent, 1, bytes);
    return send(bytes);
  }
  bool hello(Role role = Role::kViewer, std::uint32_t subscription = 0, std::optional<Token> token = {});

  /// Reads received data, `max_bytes` at most, and stores the messages; returns how many bytes.
  std::size_t take(std::size_t max_bytes = SIZE_MAX) {
    return socket_.take(max_bytes, [this](std::span<const std::byte> bytes) { hear(bytes); });
  }
  void close() { socket_.close(); }

  bool is_ended() const { return socket_.is_ended(); }  ///< the server's end of the stream was read
  PeerSocket& socket() { return socket_; }
  std::uint64_t sent = 0;  ///< sequence of the last message sent

 private:
  PeerSocket socket_;
};

}  // namespace brachy::net::test
