#include "net/wire/image_pixels.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <numeric>

#include "tests/net/wire/sample_messages.h"

namespace brachy::net {
namespace {

/// An image whose data claims to be compressed.
ImageMessage with_data(std::vector<std::uint8_t> data, std::uint16_t width = 8, std::uint16_t height = 4) {
  ImageMessage image;
  image.flags = kImageZlib;
  image.width = width;
  image.height = height;
  image.data = std::move(data);
  return image;
}

std::vector<std::uint8_t> packed(const std::vector<std::uint8_t>& pixels) {
  std::vector<std::uint8_t> out;
  PixelPacker(pixels.size()).pack(pixels, out);
  return out;
}

std::vector<std::uint8_t> counting(std::size_t size) {
  std::vector<std::uint8_t> pixels(size);
  std::iota(pixels.begin(), pixels.end(), std::uint8_t{0});
  return pixels;
}

TEST(ImagePixels, ComeBackFromTheirCompression) {
  const auto pixels = counting(32);
  std::vector<std::uint8_t> back;
  EXPECT_EQ(read_pixels(with_data(packed(pixels)), back), "");
  EXPECT_EQ(back, pixels);
}

TEST(ImagePixels, APackerPacksOneAfterTheOther) {
  PixelPacker packer(1000);
  std::vector<std::uint8_t> out, back;
  for (const std::size_t width : {1000, 1, 500}) {
    packer.pack(counting(width), out);
    EXPECT_LE(out.size(), packer.most_bytes());
    EXPECT_EQ(read_pixels(with_data(out, static_cast<std::uint16_t>(width), 1), back), "");
    EXPECT_EQ(back, counting(width));
  }
}

TEST(ImagePixels, WhatIsDamagedOrHasAnotherSizeIsRefused) {
  const auto good = packed(counting(32));
  std::vector<std::uint8_t> cut(good.begin(), good.end() - 1), longer = good, bent = good, back;
  longer.push_back(0);
  bent[good.size() - 1] ^= 1;  // its checksum
  for (const auto& bad : {cut, longer, bent, packed(counting(31)), packed(counting(33)), {}, counting(40)})
    EXPECT_NE(read_pixels(with_data(bad), back), "");
}

TEST(ImagePixels, ABombBringsNoMoreThanTheImagesSize) {
  std::vector<std::uint8_t> back;
  EXPECT_NE(read_pixels(with_data(packed(std::vector<std::uint8_t>(10'000'000))), back), "");
  EXPECT_EQ(back.size(), 32u);
}

TEST(ImagePixels, PlainOnesMustBeAsManyAsTheSizeSays) {
  ImageMessage image = test::sample_image();
  std::vector<std::uint8_t> back;
  EXPECT_EQ(read_pixels(image, back), "");
  EXPECT_EQ(back, image.data);
  image.data.pop_back();
  EXPECT_NE(read_pixels(image, back), "");
  Bytes body;
  encode_body(image, body);
  ImageMessage decoded;
  EXPECT_TRUE(decode_body(body, decoded).is_bad());
}

TEST(ImagePixels, AnImageLargerThanTheLimitIsRefusedBeforeItsPixelsAreRead) {
  ImageMessage image = with_data({}, 4097, 1);
  Bytes body;
  encode_body(image, body);
  EXPECT_TRUE(decode_body(body, image).is_bad());
}

TEST(ImagePixels, HelloAsksForCompressedOnes) {
  HelloMessage hello = test::sample_hello(), back;
  hello.image_flags = kTakesZlib;
  Bytes body;
  encode_body(hello, body);
  ASSERT_TRUE(decode_body(body, back).is_good());
  EXPECT_EQ(back.image_flags, kTakesZlib);
  EXPECT_EQ(back.needle, hello.needle);
}

}  // namespace
}  // namespace brachy::net
