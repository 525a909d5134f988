#include "tests/net/raw_peer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>

namespace brachy::net::test {

using boost::asio::ip::tcp;

RawPeer::RawPeer(boost::asio::io_context& io, std::uint16_t port, int receive_buffer, const std::string& from)
    : socket_(io) {
  socket_.open(tcp::v4());
  if (receive_buffer > 0) socket_.set_option(boost::asio::socket_base::receive_buffer_size(receive_buffer));
  socket_.bind({boost::asio::ip::make_address(from), 0});
  socket_.connect({boost::asio::ip::address_v4::loopback(), port});
  socket_.set_option(tcp::no_delay(true));
}

bool RawPeer::send(std::span<const std::byte> bytes) {
  boost::system::error_code error;
  boost::asio::write(socket_, boost::asio::buffer(bytes.data(), bytes.size()), error);
  return !error;
}

bool RawPeer::hello(Role role, std::uint32_t subscription, std::optional<Token> token) {
  HelloMessage message;
  message.role = role;
  message.subscription = subscription;
  message.name = "raw";
  message.token = token;
  return send_message(message);
}

void RawPeer::take(std::size_t max_bytes) {
  std::vector<std::byte> buffer(std::min<std::size_t>(max_bytes, 64 * 1024));
  socket_.non_blocking(true);
  while (max_bytes > 0 && !is_ended_) {
    boost::system::error_code error;
    const std::size_t size =
        socket_.read_some(boost::asio::buffer(buffer.data(), std::min(max_bytes, buffer.size())), error);
    if (error == boost::asio::error::would_block) break;
    if (error) {
      is_ended_ = true;
      break;
    }
    max_bytes -= size;
    hear(std::span<const std::byte>(buffer).first(size));
  }
  socket_.non_blocking(false);
}

void Heard::hear(std::span<const std::byte> bytes) {
  parser_.feed(bytes);
  MessageParser::Message message;
  DecodeResult result;
  while ((result = parser_.next(message)).is_good()) keep(message);
  EXPECT_FALSE(result.is_bad()) << result.reason;
}

void Heard::keep(const MessageParser::Message& message) {
  types.push_back(message.header.type);
  if (message.header.type == MessageType::kTopology) {
    TopologyMessage topology;
    EXPECT_TRUE(decode_body(message.body, topology).is_good());
    EXPECT_EQ(mesh.start(topology), "");
  } else if (message.header.type == MessageType::kFrame) {
    FrameMessage frame;
    EXPECT_TRUE(decode_body(message.body, frame).is_good());
    EXPECT_EQ(mesh.apply(frame), "");
    frames.push_back(std::move(frame));
    frame_bodies.emplace_back(message.body.begin(), message.body.end());
  } else if (message.header.type == MessageType::kError) {
    ErrorMessage error;
    EXPECT_TRUE(decode_body(message.body, error).is_good());
    if (error.fatal) fatal_ = error.code;
    errors.push_back(error);
  } else if (message.header.type == MessageType::kState) {
    StateMessage state;
    EXPECT_TRUE(decode_body(message.body, state).is_good());
    states.push_back(state);
  } else if (message.header.type == MessageType::kForce) {
    EXPECT_TRUE(decode_body(message.body, forces.emplace_back()).is_good());
  } else if (message.header.type == MessageType::kLocalModel) {
    EXPECT_TRUE(decode_body(message.body, models.emplace_back()).is_good());
  }
}

void RawPeer::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
}

}  // namespace brachy::net::test
