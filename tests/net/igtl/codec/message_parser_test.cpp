#include "net/igtl/codec/message_parser.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/codec.h"
#include "net/igtl/codec/crc64.h"

namespace brachy::net::igtl {
namespace {

Bytes transform(std::uint16_t version = 1) {
  return encode_transform({version, "NeedleToRas", 1}, {Mat3::Identity(), Vec3(1, 2, 3)});
}

/// A message with any body and its right CRC.
Bytes message(std::uint16_t version, const std::string& type, const Bytes& body) {
  Bytes out = encode_empty(type, {1, "peer", 0});
  out.resize(42);
  out[1] = static_cast<std::byte>(version);
  put(out, static_cast<std::uint64_t>(body.size()));
  put(out, crc64(body));
  out.insert(out.end(), body.begin(), body.end());
  return out;
}

Bytes body_with_metadata(const Bytes& content, const std::string& key, const std::string& value) {
  Bytes body;
  put(body, std::uint16_t{12});
  put(body, std::uint16_t{10});
  put(body, static_cast<std::uint32_t>(key.size() + value.size()));
  put(body, std::uint32_t{0});
  body.insert(body.end(), content.begin(), content.end());
  put(body, std::uint16_t{1});
  put(body, static_cast<std::uint16_t>(key.size()));
  put(body, std::uint16_t{3});
  put(body, static_cast<std::uint32_t>(value.size()));
  put_name(body, key + value, key.size() + value.size());
  return body;
}

TEST(IgtlMessageParser, TakesPiecesOfAnySize) {
  Bytes stream;
  for (int i = 0; i < 3; ++i)
    for (const Bytes& piece : {transform(1), message(1, "IMAGE", Bytes(1000)), transform(2)})
      stream.insert(stream.end(), piece.begin(), piece.end());
  for (const std::size_t piece : {1u, 7u, 58u, 100u, 5000u}) {
    MessageParser parser;
    MessageParser::Message parsed;
    int transforms = 0, skipped = 0;
    for (std::span<const std::byte> rest(stream); !rest.empty();
         rest = rest.subspan(std::min(piece, rest.size()))) {
      parser.feed(rest.first(std::min(piece, rest.size())));
      for (Parsed what; (what = parser.next(parsed)) != Parsed::kNeedMore;) {
        ASSERT_TRUE(what == Parsed::kMessage || what == Parsed::kSkipped);
        skipped += what == Parsed::kSkipped;
        if (what == Parsed::kSkipped) continue;
        ++transforms;
        EXPECT_EQ(decode_transform(parsed.content)->p, Vec3(1, 2, 3));
      }
    }
    EXPECT_EQ(transforms, 6);
    EXPECT_EQ(skipped, 3);
  }
}

TEST(IgtlMessageParser, SkipsALongBodyWithoutKeepingIt) {
  MessageParser parser;
  MessageParser::Message parsed;
  Bytes header = message(1, "IMAGE", {});
  header[42 + 4] = std::byte{0x20};  // 512 MiB
  parser.feed(header);
  EXPECT_EQ(parser.next(parsed), Parsed::kSkipped);
  const Bytes piece(1 << 20);
  for (int i = 0; i < 512; ++i) {
    parser.feed(piece);
    ASSERT_EQ(parser.next(parsed), Parsed::kNeedMore);
  }
  EXPECT_LT(parser.allocated_bytes(), 100'000u);
  parser.feed(transform());
  EXPECT_EQ(parser.next(parsed), Parsed::kMessage);
}

TEST(IgtlMessageParser, DropsAMessageWithAWrongCrcAndGoesOn) {
  Bytes wrong = transform();
  wrong.back() ^= std::byte{1};
  MessageParser parser;
  MessageParser::Message parsed;
  parser.feed(wrong);
  parser.feed(transform());
  EXPECT_EQ(parser.next(parsed), Parsed::kWrongCrc);
  EXPECT_EQ(parsed.header.type, "TRANSFORM");
  EXPECT_EQ(parser.next(parsed), Parsed::kMessage);
  EXPECT_EQ(parser.next(parsed), Parsed::kNeedMore);
}

// PLUS's default.
TEST(IgtlMessageParser, TakesAMessageWhoseSenderComputesNoCrc) {
  Bytes unchecked = transform();
  for (int i = 50; i < 58; ++i) unchecked[static_cast<std::size_t>(i)] = std::byte{0};
  MessageParser parser;
  parser.feed(unchecked);
  MessageParser::Message parsed;
  ASSERT_EQ(parser.next(parsed), Parsed::kMessage);
  EXPECT_EQ(decode_transform(parsed.content)->p, Vec3(1, 2, 3));
}

TEST(IgtlMessageParser, IsLostWithAnotherVersionOrABodyBeyondAllReason) {
  Bytes version0 = transform(), version4 = transform(), endless = message(1, "IMAGE", {});
  version0[1] = std::byte{0};
  version4[1] = std::byte{4};
  endless[42] = std::byte{0x80};
  for (const Bytes& bad : {version0, version4, endless}) {
    MessageParser parser;
    MessageParser::Message parsed;
    parser.feed(bad);
    EXPECT_EQ(parser.next(parsed), Parsed::kLost);
    parser.feed(transform());
    EXPECT_EQ(parser.next(parsed), Parsed::kLost);
  }
}

TEST(IgtlMessageParser, ReadsAHeaderOfVersion3AsOfVersion2) {
  Bytes version3 = encode_transform({2, "NeedleToRas", 1}, {Mat3::Identity(), Vec3(1, 2, 3)}, "OK");
  version3[1] = std::byte{3};
  MessageParser parser;
  MessageParser::Message parsed;
  parser.feed(version3);
  ASSERT_EQ(parser.next(parsed), Parsed::kMessage);
  EXPECT_EQ(parsed.header.type, "TRANSFORM");
  EXPECT_EQ(parsed.find_metadata("TransformStatus"), "OK");
  const auto X = decode_transform(parsed.content);
  ASSERT_TRUE(X);
  EXPECT_EQ(X->p, Vec3(1, 2, 3));
}

TEST(IgtlMessageParser, SkipsAMessageTooLongForItsType) {
  MessageParser parser;
  MessageParser::Message parsed;
  parser.feed(message(1, "TRANSFORM", Bytes(MessageParser::kMaxBodyBytes + 1)));
  EXPECT_EQ(parser.next(parsed), Parsed::kSkipped);
  EXPECT_EQ(parser.next(parsed), Parsed::kNeedMore);
}

TEST(IgtlMessageParser, FindsMetadataOfVersion2) {
  const Bytes whole = transform(), content(whole.begin() + kHeaderSize, whole.end());
  MessageParser parser;
  MessageParser::Message parsed;
  parser.feed(message(2, "TRANSFORM", body_with_metadata(content, "TransformStatus", "INVALID")));
  ASSERT_EQ(parser.next(parsed), Parsed::kMessage);
  EXPECT_EQ(decode_transform(parsed.content)->p, Vec3(1, 2, 3));
  EXPECT_EQ(parsed.find_metadata("TransformStatus"), "INVALID");
  EXPECT_EQ(parsed.find_metadata("Transform"), std::nullopt);
}

TEST(IgtlMessageParser, DropsVersion2WhoseSizesCannotBe) {
  MessageParser::Message parsed;
  for (const auto& body : {Bytes(5), Bytes(20, std::byte{0xff}), Bytes(12)}) {
    MessageParser parser;
    parser.feed(message(2, "TRANSFORM", body));
    parser.feed(transform(2));
    EXPECT_EQ(parser.next(parsed), Parsed::kMalformed);
    EXPECT_EQ(parser.next(parsed), Parsed::kMessage);
  }
}

TEST(IgtlMessageParser, MetadataThatLiesAboutItsSizeIsNotFound) {
  Bytes body = body_with_metadata({}, "key", "value");
  for (std::size_t i = 12; i < 22; ++i) {
    Bytes lying = body;
    lying[i] = std::byte{0xff};
    MessageParser parser;
    MessageParser::Message parsed;
    parser.feed(message(2, "STP_TDATA", lying));
    ASSERT_EQ(parser.next(parsed), Parsed::kMessage);
    parsed.find_metadata("other");
    if (i >= 14 && i != 16 && i != 17) {
      EXPECT_EQ(parsed.find_metadata("key"), std::nullopt) << i;
    }
  }
}

TEST(IgtlMessageParser, NoiseNeitherReadsOutsideNorGrows) {
  std::mt19937 random(1);
  for (int run = 0; run < 3000; ++run) {
    Bytes stream;
    for (int i = 0; i < 3; ++i) {
      Bytes piece = message(static_cast<std::uint16_t>(1 + random() % 2), "TRANSFORM",
                            body_with_metadata(Bytes(random() % 60), "key", "value"));
      stream.insert(stream.end(), piece.begin(), piece.end());
    }
    for (int i = 0; i < 4; ++i)
      stream[random() % stream.size()] ^= static_cast<std::byte>(1u << random() % 8);
    MessageParser parser;
    MessageParser::Message parsed;
    parser.feed(stream);
    for (Parsed what; (what = parser.next(parsed)) != Parsed::kNeedMore && what != Parsed::kLost;) {
      if (what != Parsed::kMessage) continue;
      parsed.find_metadata("key");
      decode_transform(parsed.content);
    }
    EXPECT_LE(parser.allocated_bytes(), 4 * stream.size());
  }
}

}  // namespace
}  // namespace brachy::net::igtl
