#include "tests/net/http/websocket_peer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <utility>

namespace brachy::net::test {

std::string upgrade_request(std::uint16_t port, const std::string& more) {
  return "GET /ws HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
         more + "\r\n";
}

Bytes websocket_frame(Opcode opcode, std::span<const std::byte> payload, bool is_last, bool is_masked) {
  Bytes frame;
  const auto put = [&](std::size_t value, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) frame.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFF));
  };
  put((is_last ? 0x80u : 0u) | static_cast<unsigned>(opcode), 1);
  const unsigned mask_bit = is_masked ? 0x80 : 0;
  if (payload.size() < 126) {
    put(mask_bit | payload.size(), 1);
  } else if (payload.size() < 65536) {
    put(mask_bit | 126, 1), put(payload.size(), 2);
  } else {
    put(mask_bit | 127, 1), put(payload.size(), 8);
  }
  constexpr std::array<std::byte, 4> kMask = {std::byte{0x12}, std::byte{0x34}, std::byte{0x56},
                                              std::byte{0x78}};
  if (is_masked) frame.insert(frame.end(), kMask.begin(), kMask.end());
  for (std::size_t i = 0; i < payload.size(); ++i)
    frame.push_back(is_masked ? payload[i] ^ kMask[i % kMask.size()] : payload[i]);
  return frame;
}

WebSocketPeer::WebSocketPeer(boost::asio::io_context& io, std::uint16_t port, int receive_buffer,
                             TlsContext tls)
    : socket_(io, port, receive_buffer, std::move(tls)) {
  const std::string request = upgrade_request(port);
  send(std::as_bytes(std::span(request)));
}

bool WebSocketPeer::hello(Role role, std::uint32_t subscription, std::optional<Token> token) {
  HelloMessage message;
  message.role = role;
  message.subscription = subscription;
  message.name = "page";
  message.token = token;
  return send_message(message);
}

std::size_t WebSocketPeer::take(std::size_t max_bytes) {
  return socket_.take(max_bytes, [this](std::span<const std::byte> bytes) {
    unread_.insert(unread_.end(), bytes.begin(), bytes.end());
    understand();
  });
}

std::size_t WebSocketPeer::take_soon() {
  socket_.wait();
  return take();
}

void WebSocketPeer::understand() {
  std::size_t at = 0;
  if (!is_open_) {
    while (at < unread_.size() && !answer_.ends_with("\r\n\r\n"))
      answer_ += static_cast<char>(std::to_integer<unsigned char>(unread_[at++]));
    is_open_ = answer_.starts_with("HTTP/1.1 101 ") && answer_.ends_with("\r\n\r\n");
  }
  while (is_open_) {
    const auto rest = std::span<const std::byte>(unread_).subspan(at);
    const auto number = [&](std::size_t from, std::size_t bytes) {
      std::size_t value = 0;
      for (const std::byte b : rest.subspan(from, bytes))
        value = value << 8 | std::to_integer<std::size_t>(b);
      return value;
    };
    if (rest.size() < 2) break;
    std::size_t size = number(1, 1), header = 2;
    const std::size_t long_size = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (rest.size() < header + long_size) break;
    if (long_size > 0) size = number(header, long_size);
    header += long_size;
    if (rest.size() < header + size) break;
    const auto payload = rest.subspan(header, size);
    const std::size_t first = number(0, 1);
    EXPECT_EQ(first & 0xF0, 0x80u) << "a fragment, or reserved bits";
    switch (static_cast<Opcode>(first & 0x0F)) {
      case Opcode::kBinary: {
        const std::size_t heard = types.size();
        hear(payload);
        EXPECT_EQ(types.size(), heard + 1) << "not one message in a WebSocket message";
        break;
      }
      case Opcode::kClose:
        close_code_ = size >= 2 ? static_cast<int>(number(header, 2)) : 1005;
        break;
      case Opcode::kPong:
        ++pongs;
        last_pong.assign(payload.begin(), payload.end());
        break;
      default:
        ADD_FAILURE() << "opcode " << (first & 0x0F);
    }
    at += header + size;
  }
  unread_.erase(unread_.begin(), unread_.begin() + static_cast<std::ptrdiff_t>(at));
}

}  // namespace brachy::net::test
