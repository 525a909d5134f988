#include "tests/net/raw_peer.h"

#include <gtest/gtest.h>

namespace brachy::net::test {

bool RawPeer::hello(Role role, std::uint32_t subscription, std::optional<Token> token) {
  HelloMessage message;
  message.role = role;
  message.subscription = subscription;
  message.name = "raw";
  message.token = token;
  return send_message(message);
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
  } else if (message.header.type == MessageType::kEvent) {
    EXPECT_TRUE(decode_body(message.body, events.emplace_back()).is_good());
  } else if (message.header.type == MessageType::kForce) {
    EXPECT_TRUE(decode_body(message.body, forces.emplace_back()).is_good());
  } else if (message.header.type == MessageType::kLocalModel) {
    EXPECT_TRUE(decode_body(message.body, models.emplace_back()).is_good());
  } else if (message.header.type == MessageType::kImage) {
    EXPECT_TRUE(decode_body(message.body, images.emplace_back()).is_good());
  }
}

}  // namespace brachy::net::test
