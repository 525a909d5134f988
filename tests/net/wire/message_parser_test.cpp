#include "net/wire/message_parser.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

using Status = DecodeResult::Status;

Bytes stream() {
  Bytes bytes;
  encode(sample_hello(), 1, 10, bytes);
  encode(sample_pose(), 2, 20, bytes);
  encode(sample_ping(), 3, 30, bytes);
  return bytes;
}

TEST(MessageParser, TakesMessagesFromPiecesOfAnySize) {
  const Bytes bytes = stream();
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{33}, bytes.size()}) {
    MessageParser parser(1000);
    MessageParser::Message message;
    std::vector<MessageType> types;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      parser.feed(std::span<const std::byte>(bytes).subspan(at, std::min(piece, bytes.size() - at)));
      while (parser.next(message).is_good()) {
        types.push_back(message.header.type);
        EXPECT_EQ(message.body.size(), message.header.length);
      }
      ASSERT_EQ(parser.next(message).status, Status::kNeedMore);
    }
    EXPECT_EQ(types, (std::vector{MessageType::kHello, MessageType::kPose, MessageType::kPing})) << piece;
  }
}

TEST(MessageParser, RefusesALengthOverTheLimitBeforeTheBodyComes) {
  for (const std::uint32_t length : {1001u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
    MessageParser parser(1000);
    Bytes header;
    encode_header({kProtocolVersion, MessageType::kHello, 0, length, 1, 0}, header);
    parser.feed(header);
    MessageParser::Message message;
    const DecodeResult result = parser.next(message);
    ASSERT_TRUE(result.is_bad());
    EXPECT_EQ(result.code, ErrorCode::kTooLarge);
    EXPECT_LE(parser.allocated_bytes(), 64u);
    parser.feed(Bytes(10'000));  // takes no more
    EXPECT_TRUE(parser.next(message).is_bad());
    EXPECT_LE(parser.allocated_bytes(), 64u);
  }
}

TEST(MessageParser, RefusesAWrongMagicAtItsFirstByte) {
  MessageParser parser(1000);
  parser.feed(Bytes{std::byte{'B'}, std::byte{'R'}});
  MessageParser::Message message;
  EXPECT_EQ(parser.next(message).status, Status::kNeedMore);
  parser.feed(Bytes{std::byte{'X'}});
  EXPECT_TRUE(parser.next(message).is_bad());
}

TEST(MessageParser, RefusesAnotherVersionAndGapsInTheSequence) {
  MessageParser::Message message;
  {
    MessageParser parser(1000);
    Bytes header;
    encode_header({2, MessageType::kHello, 0, 0, 1, 0}, header);
    parser.feed(header);
    EXPECT_EQ(parser.next(message).code, ErrorCode::kVersion);
  }
  for (const std::uint64_t second : {1u, 3u, 0u}) {
    MessageParser parser(1000);
    Bytes bytes;
    encode(sample_ping(), 1, 0, bytes);
    encode(sample_ping(), second, 0, bytes);
    parser.feed(bytes);
    EXPECT_TRUE(parser.next(message).is_good());
    EXPECT_TRUE(parser.next(message).is_bad());
  }
}

TEST(MessageParser, MessagesOfUnknownTypeComeThroughToBeSkipped) {
  MessageParser parser(1000);
  Bytes bytes;
  encode_header({kProtocolVersion, static_cast<MessageType>(999), 5, 0, 1, 0}, bytes);
  encode(sample_ping(), 2, 0, bytes);
  parser.feed(bytes);
  MessageParser::Message message;
  ASSERT_TRUE(parser.next(message).is_good());
  EXPECT_EQ(static_cast<int>(message.header.type), 999);
  ASSERT_TRUE(parser.next(message).is_good());
}

TEST(MessageParser, AnyBytesAreCutWithoutHarm) {
  std::mt19937 random(7);
  const Bytes bytes = stream();
  for (int i = 0; i < 20'000; ++i) {
    Bytes mutated = bytes;
    mutated[random() % mutated.size()] = static_cast<std::byte>(random() & 0xFF);
    MessageParser parser(1000);
    MessageParser::Message message;
    std::size_t at = 0;
    while (at < mutated.size()) {
      const std::size_t piece = std::min<std::size_t>(1 + random() % 100, mutated.size() - at);
      parser.feed(std::span<const std::byte>(mutated).subspan(at, piece));
      at += piece;
      while (parser.next(message).is_good()) ASSERT_LE(message.body.size(), 1000u);
    }
    ASSERT_LE(parser.allocated_bytes(), 3000u);
  }
}

}  // namespace
}  // namespace brachy::net::test
