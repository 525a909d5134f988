#include "net/igtl/codec/codec.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <sstream>

#include "net/igtl/codec/crc64.h"

namespace brachy::net::igtl {
namespace {

Bytes bytes_of(std::string_view text) {
  Bytes bytes;
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  return bytes;
}

Bytes hex(const std::string& text) {
  Bytes bytes;
  std::istringstream in(text);
  for (unsigned value = 0; in >> std::hex >> value;) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

/// A turn by 90° about z.
RigidTransform turned() {
  RigidTransform X;
  X.R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  X.p = Vec3(1, -2, 0.5);
  return X;
}

TEST(IgtlCrc, IsThatOfEcma182) {
  EXPECT_EQ(crc64(bytes_of("123456789")), 0x6C40DF5F0B497347u);
  EXPECT_EQ(crc64({}), 0u);
}

TEST(IgtlCrc, GoesOnWhereItStopped) {
  Bytes bytes;
  for (int i = 0; i < 100; ++i) bytes.push_back(static_cast<std::byte>(37 * i));
  const std::span<const std::byte> all(bytes);
  for (std::size_t cut = 0; cut <= all.size(); ++cut)
    EXPECT_EQ(crc64(all.subspan(cut), crc64(all.first(cut))), crc64(all)) << cut;
}

TEST(IgtlTimestamp, IsSecondsInFixedPoint) {
  EXPECT_EQ(to_timestamp(0), 0u);
  EXPECT_EQ(to_timestamp(-1), 0u);
  EXPECT_EQ(to_timestamp(1'500'000'000), 0x1'80000000u);
  for (const std::int64_t ns : {1'699'999'999'999'999'999L, 1'700'000'000'000'000'001L, 1'250'000'000L})
    EXPECT_NEAR(static_cast<double>(to_ns(to_timestamp(ns)) - ns), 0, 1);
}

// By hand from the protocol's documents: header.md, transform.md.
TEST(IgtlCodec, TransformIsColumnByColumn) {
  const Bytes message = encode_transform({1, "NeedleToRas", 0x0102030405060708}, turned());
  const Bytes golden = hex(R"(
    00 01
    54 52 41 4e 53 46 4f 52 4d 00 00 00
    4e 65 65 64 6c 65 54 6f 52 61 73 00 00 00 00 00 00 00 00 00
    01 02 03 04 05 06 07 08
    00 00 00 00 00 00 00 30
    00 00 00 00 00 00 00 00
    00 00 00 00 3f 80 00 00 00 00 00 00
    bf 80 00 00 00 00 00 00 00 00 00 00
    00 00 00 00 00 00 00 00 3f 80 00 00
    3f 80 00 00 c0 00 00 00 3f 00 00 00)");
  ASSERT_EQ(message.size(), golden.size());
  for (std::size_t i = 0; i < golden.size(); ++i) {
    if (i < 50 || i >= 58) {  // beside the CRC
      EXPECT_EQ(message[i], golden[i]) << i;
    }
  }
  EXPECT_EQ(decode_header(message).crc, crc64(std::span<const std::byte>(message).subspan(58)));
}

TEST(IgtlCodec, Version2HasAnExtendedHeaderAndACountOfNoMetadata) {
  const Bytes one = encode_transform({1, "NeedleToRas", 7}, turned());
  const Bytes two = encode_transform({2, "NeedleToRas", 7}, turned());
  // sizes of itself, metadata's header, metadata; id
  const Bytes extended = hex("00 0c 00 02 00 00 00 00 00 00 00 00");
  ASSERT_EQ(two.size(), one.size() + 14);
  EXPECT_EQ(two[1], std::byte{2});
  EXPECT_EQ(decode_header(two).body_size, 48u + 14);
  EXPECT_TRUE(std::equal(extended.begin(), extended.end(), two.begin() + 58));
  EXPECT_TRUE(std::equal(one.begin() + 58, one.end(), two.begin() + 70));
  EXPECT_EQ(two[two.size() - 2], std::byte{0});
  EXPECT_EQ(two.back(), std::byte{0});
  EXPECT_EQ(decode_header(two).crc, crc64(std::span<const std::byte>(two).subspan(58)));
}

TEST(IgtlCodec, TransformComesBackInSinglePrecision) {
  RigidTransform X = turned();
  X.p = Vec3(1.0 / 3, 1e6, -1e-6);
  const Bytes message = encode_transform({1, "x", 0}, X);
  const auto back = decode_transform(std::span<const std::byte>(message).subspan(58));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->R, X.R);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(back->p(i), static_cast<double>(static_cast<float>(X.p(i))));
  EXPECT_FALSE(decode_transform(std::span<const std::byte>(message).subspan(59)));
  EXPECT_FALSE(decode_transform({}));
}

TEST(IgtlCodec, NamesAreCutAndWhatIsNotPrintableIsShown) {
  const Bytes message = encode_empty("GET_POLYDATA", {1, "a name of more than twenty bytes", 0});
  const Header header = decode_header(message);
  EXPECT_EQ(header.type, "GET_POLYDATA");
  EXPECT_EQ(header.device, "a name of more than ");
  Bytes odd = message;
  odd[14] = std::byte{0x1b};
  odd[15] = std::byte{0xff};
  EXPECT_EQ(decode_header(odd).device, "??name of more than ");
}

TEST(IgtlCodec, PolydataHasPointsAndTrianglesAndNothingElse) {
  const std::array<float, 6> points = {1, 2, 3, 4, 5, 6};
  const std::array<Triangle, 1> triangles = {Triangle{0, 1, 0}};
  const Bytes message = encode_polydata({1, "prostate", 0}, points, encode_triangles(triangles), 1);
  const Bytes golden = hex(R"(
    00 00 00 02
    00 00 00 00 00 00 00 00
    00 00 00 00 00 00 00 00
    00 00 00 01 00 00 00 10
    00 00 00 00 00 00 00 00
    00 00 00 00
    3f 80 00 00 40 00 00 00 40 40 00 00
    40 80 00 00 40 a0 00 00 40 c0 00 00
    00 00 00 03 00 00 00 00 00 00 00 01 00 00 00 00)");
  EXPECT_EQ(Bytes(message.begin() + 58, message.end()), golden);
}

}  // namespace
}  // namespace brachy::net::igtl
