#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/rigid_transform.h"

namespace brachy {

/// A regular grid of voxels in the world, oblique and anisotropic if need be. Voxel (i, j, k) has its centre at
/// origin + steps · (i, j, k); i varies fastest in memory.
struct VoxelGrid {
  std::array<std::size_t, 3> size{};  ///< along i, j, k
  Vec3 origin = Vec3::Zero();         ///< centre of voxel (0, 0, 0), mm, RAS
  Mat3 steps = Mat3::Identity();  ///< columns: from a voxel to the next along i, j, k; mm, RAS; not singular

  std::size_t count() const { return size[0] * size[1] * size[2]; }
  std::size_t index(std::size_t i, std::size_t j, std::size_t k) const {
    return (k * size[1] + j) * size[0] + i;
  }
  Vec3 position(const Vec3& ijk) const { return origin + steps * ijk; }  ///< mm
  double voxel_mm3() const { return std::abs(steps.determinant()); }
};

}  // namespace brachy
