#include "net/igtl/codec/crc64.h"

#include <array>

namespace brachy::net::igtl {
namespace {

constexpr std::uint64_t kPolynomial = 0x42F0E1EBA9EA3693;
constexpr std::size_t kSlices = 8;
using Table = std::array<std::array<std::uint64_t, 256>, kSlices>;

/// table[k][b]: what byte b does to the CRC with k bytes behind it.
constexpr Table make_table() {
  Table table{};
  for (std::size_t b = 0; b < 256; ++b) {
    std::uint64_t crc = static_cast<std::uint64_t>(b) << 56;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc >> 63) != 0 ? kPolynomial : 0);
    table[0][b] = crc;
  }
  for (std::size_t k = 1; k < kSlices; ++k)
    for (std::size_t b = 0; b < 256; ++b)
      table[k][b] = (table[k - 1][b] << 8) ^ table[0][table[k - 1][b] >> 56];
  return table;
}

constexpr Table kTable = make_table();

}  // namespace

std::uint64_t crc64(std::span<const std::byte> bytes, std::uint64_t crc) {
  for (; bytes.size() >= kSlices;
       bytes = bytes.subspan(kSlices)) {  // eight bytes in one step: a table for each
    std::uint64_t next = 0;
    for (std::size_t k = 0; k < kSlices; ++k) {
      const auto byte = std::to_integer<std::uint64_t>(bytes[k]) ^ ((crc >> (56 - 8 * k)) & 0xFF);
      next ^= kTable[kSlices - 1 - k][byte];
    }
    crc = next;
  }
  for (const std::byte byte : bytes)
    crc = (crc << 8) ^ kTable[0][(crc >> 56) ^ std::to_integer<std::uint64_t>(byte)];
  return crc;
}

}  // namespace brachy::net::igtl
