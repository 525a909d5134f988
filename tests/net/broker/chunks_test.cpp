#include "net/broker/chunks.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/net/wire/golden_blocks.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

using Taken = ChunkAssembler::Taken;

constexpr std::uint64_t kPublisher = 77;
constexpr std::uint32_t kMaxBytes = 1 << 20;

/// An EVENT, or any other message whose body is as long as that.
struct Message {
  Bytes header, body;
  explicit Message(std::size_t length, MessageType type = MessageType::kFrame) {
    for (std::size_t i = 0; i < length; ++i) body.push_back(static_cast<std::byte>(i * 7));
    encode_header({kProtocolVersion, type, 0, static_cast<std::uint32_t>(length), 1, 2}, header);
  }
};

std::vector<Bytes> chunks_of(const Message& message, std::uint64_t epoch, std::uint64_t sequence,
                             std::size_t max_payload, std::uint64_t publisher = kPublisher) {
  std::vector<Bytes> chunks;
  Bytes buffer;
  EXPECT_TRUE(send_chunks({publisher, epoch, sequence, 0, 0}, message.header, message.body, max_payload,
                          buffer, [&](std::span<const std::byte> chunk) {
                            EXPECT_LE(chunk.size(), max_payload);
                            chunks.emplace_back(chunk.begin(), chunk.end());
                            return true;
                          }));
  return chunks;
}

std::vector<Taken> take_all(ChunkAssembler& assembler, const std::vector<Bytes>& chunks) {
  std::vector<Taken> taken;
  for (const Bytes& chunk : chunks) taken.push_back(assembler.take(chunk));
  return taken;
}

TEST(Chunks, AMessageComesBackBitForBitHoweverSmallThePayload) {
  for (const std::size_t payload : {41, 73, 100, 5000, 1'000'000}) {
    ChunkAssembler assembler(kMaxBytes);
    for (const std::size_t length : {0, 1, 31, 1000}) {
      const std::uint64_t sequence = length == 0 ? 1 : assembler.message().chunk.sequence + 1;
      const Message message(length);
      const auto chunks = chunks_of(message, 1, sequence, payload);
      EXPECT_EQ(chunks.size(), (kHeaderSize + length + payload - 41) / (payload - 40));
      const auto taken = take_all(assembler, chunks);
      ASSERT_EQ(taken.back(), Taken::kMessage) << payload << " " << length;
      for (std::size_t i = 0; i + 1 < taken.size(); ++i) EXPECT_EQ(taken[i], Taken::kPart);
      EXPECT_EQ(assembler.message().header.type, MessageType::kFrame);
      EXPECT_EQ(Bytes(assembler.message().body.begin(), assembler.message().body.end()), message.body);
    }
    EXPECT_EQ(assembler.left_out(), 0u);
  }
}

TEST(Chunks, APayloadWithoutSpaceSendsNothing) {
  Bytes buffer;
  const Message message(10);
  const auto send = [](std::span<const std::byte>) { return ADD_FAILURE() << "sent", true; };
  EXPECT_FALSE(send_chunks({}, message.header, message.body, kChunkHeaderSize, buffer, send));
}

TEST(Chunks, SendingEndsWithTheFirstThatFails) {
  Bytes buffer;
  const Message message(1000);
  int sent = 0;
  EXPECT_FALSE(send_chunks({}, message.header, message.body, 100, buffer,
                           [&](std::span<const std::byte>) { return ++sent < 3; }));
  EXPECT_EQ(sent, 3);
}

TEST(Chunks, WithoutAnEpochsBeginningNothingIsTaken) {
  ChunkAssembler assembler(kMaxBytes);
  for (const Bytes& chunk : chunks_of(Message(100), 1, 2, 80))
    EXPECT_EQ(assembler.take(chunk), Taken::kLeftOut);
  EXPECT_TRUE(assembler.is_waiting());
  EXPECT_EQ(take_all(assembler, chunks_of(Message(10), 1, 1, 500)).back(), Taken::kMessage);
  EXPECT_FALSE(assembler.is_waiting());
}

TEST(Chunks, AMissingChunkLosesTheEpochUntilTheNext) {
  for (const std::size_t missing : {0, 1, 2}) {
    ChunkAssembler assembler(kMaxBytes);
    ASSERT_EQ(take_all(assembler, chunks_of(Message(10), 4, 1, 500)).back(), Taken::kMessage);
    auto chunks = chunks_of(Message(100), 4, 2, 90);
    ASSERT_EQ(chunks.size(), 3u);
    chunks.erase(chunks.begin() + static_cast<std::ptrdiff_t>(missing));
    const auto more = chunks_of(Message(10), 4, 3, 500);
    chunks.insert(chunks.end(), more.begin(), more.end());
    const auto taken = take_all(assembler, chunks);
    EXPECT_EQ(std::ranges::count(taken, Taken::kMessage), 0);
    EXPECT_EQ(std::ranges::count(taken, Taken::kLost), 1);
    EXPECT_TRUE(assembler.is_waiting());
    // The same epoch's beginning is older than what was lost.
    EXPECT_EQ(assembler.take(chunks_of(Message(10), 4, 1, 500)[0]), Taken::kLeftOut);
    EXPECT_EQ(assembler.take(chunks_of(Message(10), 3, 1, 500)[0]), Taken::kLeftOut);
    EXPECT_EQ(assembler.take(chunks_of(Message(10), 5, 1, 500)[0]), Taken::kMessage);
  }
}

TEST(Chunks, ChunksInAnotherOrderLoseTheEpoch) {
  ChunkAssembler assembler(kMaxBytes);
  auto chunks = chunks_of(Message(100), 1, 1, 90);
  std::swap(chunks[1], chunks[2]);
  EXPECT_EQ(take_all(assembler, chunks), (std::vector{Taken::kPart, Taken::kLost, Taken::kLeftOut}));
}

TEST(Chunks, AChunkThatComesTwiceIsLeftOut) {
  ChunkAssembler assembler(kMaxBytes);
  const auto first = chunks_of(Message(100), 1, 1, 90), second = chunks_of(Message(50), 1, 2, 90);
  for (const Bytes& chunk : {first[0], first[1]}) {
    EXPECT_EQ(assembler.take(chunk), Taken::kPart);
    EXPECT_EQ(assembler.take(chunk), Taken::kLeftOut);
  }
  EXPECT_EQ(assembler.take(first[2]), Taken::kMessage);
  EXPECT_EQ(assembler.take(first[2]), Taken::kLeftOut);
  EXPECT_EQ(take_all(assembler, second).back(), Taken::kMessage);
}

TEST(Chunks, AnotherPublisherIsTakenFromItsBeginningOnOnly) {
  ChunkAssembler assembler(kMaxBytes);
  ASSERT_EQ(assembler.take(chunks_of(Message(10), 9, 1, 500)[0]), Taken::kMessage);
  EXPECT_EQ(assembler.take(chunks_of(Message(10), 9, 2, 500, 78)[0]), Taken::kLeftOut);
  EXPECT_EQ(assembler.take(chunks_of(Message(20), 9, 2, 500)[0]), Taken::kMessage);
  EXPECT_EQ(assembler.take(chunks_of(Message(10), 1, 1, 500, 78)[0]), Taken::kMessage);
  EXPECT_EQ(assembler.message().chunk.publisher, 78u);
  EXPECT_EQ(assembler.take(chunks_of(Message(10), 9, 3, 500)[0]), Taken::kLeftOut);
}

TEST(Chunks, WhatIsNoChunkIsLeftOut) {
  ChunkAssembler assembler(kMaxBytes);
  const Bytes good = chunks_of(Message(10), 1, 1, 500)[0];
  const auto changed = [&](std::size_t at, unsigned value) {
    Bytes chunk = good;
    chunk[at] = static_cast<std::byte>(value);
    return chunk;
  };
  const Bytes text(100, std::byte{'x'});
  for (const Bytes& bad : {Bytes{}, text, Bytes(good.begin(), good.begin() + 39),
                           Bytes(good.begin(), good.begin() + 40), changed(0, 0), changed(4, 2),
                           changed(32, 0), changed(32, 41), changed(35, 1), changed(36, 1), changed(39, 255)})
    EXPECT_NE(assembler.take(bad), Taken::kMessage);
  EXPECT_EQ(assembler.take(good), Taken::kMessage);
}

TEST(Chunks, AMessageWhoseHeaderSaysAnotherLengthLosesTheEpoch) {
  Message message(10);
  message.body.push_back({});
  ChunkAssembler assembler(kMaxBytes);
  EXPECT_EQ(assembler.take(chunks_of(message, 1, 1, 500)[0]), Taken::kLost);
  EXPECT_TRUE(assembler.is_waiting());
}

TEST(Chunks, AnAnnouncedLengthTakesNoMemory) {
  ChunkAssembler assembler(kMaxBytes);
  Message huge(10);
  Bytes chunk = chunks_of(huge, 1, 1, 500)[0];
  chunk[34] = std::byte{0x10};  // a megabyte
  EXPECT_EQ(assembler.take(chunk), Taken::kLeftOut) << "longer than allowed";
  chunk[34] = std::byte{0x0F};
  EXPECT_EQ(assembler.take(chunk), Taken::kPart);
  EXPECT_LT(assembler.allocated_bytes(), 1000u);
}

TEST(Chunks, TheDocumentsBytesAreWhatIsSent) {
  const auto blocks = golden_blocks("/net/NATS.md");
  ASSERT_TRUE(blocks.contains("CHUNK"));
  Bytes message, sent, buffer;
  encode(sample_event(), 5, 2'000'000'005, message);
  const auto header = std::span(message).first(kHeaderSize), body = std::span(message).subspan(kHeaderSize);
  ASSERT_TRUE(send_chunks({0x0807060504030201, 2, 7, 0, 0}, header, body, 256 * 1024, buffer,
                          [&](std::span<const std::byte> chunk) {
                            sent.assign(chunk.begin(), chunk.end());
                            return true;
                          }));
  EXPECT_EQ(sent, blocks.at("CHUNK"));
}

}  // namespace
}  // namespace brachy::net::test
