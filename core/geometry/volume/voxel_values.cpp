#include "core/geometry/volume/voxel_values.h"

#include <bit>
#include <cstdint>

namespace brachy {
namespace {

std::uint64_t stored_bits(std::string_view data, std::size_t at, const VoxelType& type) {
  std::uint64_t bits = 0;
  for (std::size_t b = 0; b < type.bytes; ++b) {
    const std::size_t place = type.is_big_endian ? type.bytes - 1 - b : b;
    bits |= std::uint64_t{static_cast<unsigned char>(data[at + b])} << 8 * place;
  }
  return bits;
}

}  // namespace

double voxel_value(std::string_view data, std::size_t at, const VoxelType& type) {
  const std::uint64_t bits = stored_bits(data, at, type);
  if (type.is_real && type.bytes == 4)
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
  if (type.is_real) return std::bit_cast<double>(bits);
  if (!type.is_signed) return static_cast<double>(bits);
  const unsigned shift = 64 - 8 * static_cast<unsigned>(type.bytes);
  return static_cast<double>(static_cast<std::int64_t>(bits << shift) >> shift);
}

}  // namespace brachy
