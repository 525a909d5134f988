#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace brachy {

/// How the voxels of a file are stored.
struct VoxelType {
  std::size_t bytes = 1;  ///< 1, 2, 4 or 8
  bool is_signed = false, is_real = false;
  bool is_big_endian = false;
};

/// `count` voxels of `data` (at least count · type.bytes long) as labels. Errors: UserError "name: …" for a value that
/// is negative, above 65535 or not whole: the file is an image, not a label map.
std::vector<std::uint16_t> to_labels(std::string_view data, std::size_t count, const VoxelType& type,
                                     const std::string& name);

/// The value of voxel `n` as a number.
double voxel_value(std::string_view data, std::size_t n, const VoxelType& type);

}  // namespace brachy
