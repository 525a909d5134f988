#pragma once

#include <cstddef>
#include <string_view>

namespace brachy {

/// How the voxels of a file are stored.
struct VoxelType {
  std::size_t bytes = 1;  ///< 1, 2, 4 or 8
  bool is_signed = false, is_real = false;
  bool is_big_endian = false;

  bool operator==(const VoxelType&) const = default;
};

/// The value at byte `at` of `data`, which must hold it, as a number. Whole numbers of 64 bits are rounded to a double.
double voxel_value(std::string_view data, std::size_t at, const VoxelType& type);

}  // namespace brachy
