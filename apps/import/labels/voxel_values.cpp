#include "apps/import/labels/voxel_values.h"

#include <bit>
#include <cmath>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace brachy {
namespace {

std::uint64_t stored_bits(std::string_view data, std::size_t n, const VoxelType& type) {
  std::uint64_t bits = 0;
  for (std::size_t b = 0; b < type.bytes; ++b) {
    const std::size_t place = type.is_big_endian ? type.bytes - 1 - b : b;
    bits |= std::uint64_t{static_cast<unsigned char>(data[n * type.bytes + b])} << 8 * place;
  }
  return bits;
}

}  // namespace

double voxel_value(std::string_view data, std::size_t n, const VoxelType& type) {
  const std::uint64_t bits = stored_bits(data, n, type);
  if (type.is_real && type.bytes == 4) return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
  if (type.is_real) return std::bit_cast<double>(bits);
  if (!type.is_signed) return static_cast<double>(bits);
  const unsigned shift = 64 - 8 * static_cast<unsigned>(type.bytes);
  return static_cast<double>(static_cast<std::int64_t>(bits << shift) >> shift);
}

std::vector<std::uint16_t> to_labels(std::string_view data, std::size_t count, const VoxelType& type,
                                     const std::string& name) {
  std::vector<std::uint16_t> labels(count);
  if (type.bytes == 1 && !type.is_signed) {
    for (std::size_t n = 0; n < count; ++n) labels[n] = static_cast<unsigned char>(data[n]);
    return labels;
  }
  for (std::size_t n = 0; n < count; ++n) {
    const double value = voxel_value(data, n, type);
    if (!(value >= 0 && value <= 65535) || value != std::floor(value))
      throw UserError(
          name + ": has the voxel value " + text_of(value) +
          ", so it is an image, not a label map; give a segmentation with whole labels 0 … 65535");
    labels[n] = static_cast<std::uint16_t>(value);
  }
  return labels;
}

}  // namespace brachy
