#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// Values on a grid that lies anywhere in space, such as an image or a label map.
/// Threads: const functions from any. Real-time: they do not allocate, but coarsened and the constructor do.
class Volume {
 public:
  /// `values`: grid.count() of them, i fastest. The steps must span space (det ≠ 0).
  Volume(const VoxelGrid& grid, std::vector<float> values);

  const VoxelGrid& grid() const { return grid_; }
  std::span<const float> values() const { return values_; }
  float value(std::size_t i, std::size_t j, std::size_t k) const { return values_[grid_.index(i, j, k)]; }

  /// The continuous index of a place X (mm, W).
  Vec3 index_of(const Vec3& X) const noexcept { return to_index_ * (X - grid_.origin); }
  /// Whether X lies in a voxel: within half a step of a middle.
  bool contains(const Vec3& X) const noexcept;
  /// How far X is within the outermost voxels' middles, in steps along the nearest side; negative outside.
  double steps_inside(const Vec3& X) const noexcept;
  /// Trilinear between middles; beyond the outermost ones as at the nearest place within.
  float at(const Vec3& X) const noexcept;
  /// Of the voxel that X is in or nearest to: for labels.
  float nearest(const Vec3& X) const noexcept;

  /// Means of whole groups of voxels along each axis, so that steps become as near to `step_mm` as they can without
  /// passing it; voxels left over at the end join the last group. What is coarser already stays.
  Volume coarsened(double step_mm) const;

 private:
  Vec3 clamped_index(const Vec3& X) const noexcept;

  VoxelGrid grid_;
  Mat3 to_index_;
  std::vector<float> values_;
};

}  // namespace brachy
