#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/base/simd/simd_target.h"
#include "core/brachytherapy/dose/dose_seed.h"
#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// Total dose (Gy, of the whole decay) at the points of a regular grid along the world's axes: of the seeds added so
/// far, each by TG-43U1 in float, within 0.05 % of dose_rate.h at every point (6711: 0.001 %). Threads: one at a time.
class DoseGrid {
 public:
  static constexpr std::size_t kMaxPoints = std::size_t{1} << 27;  ///< half a gigabyte

  /// Points at min, min + spacing, … on to the first at or beyond max on each axis; mm, world frame.
  /// Errors: UserError where that is more than kMaxPoints (use a larger spacing).
  DoseGrid(const Vec3& min, const Vec3& max, double spacing_mm, SimdTarget target = best_simd_target());

  const Vec3& origin() const { return origin_; }  ///< of point (0, 0, 0), mm
  double spacing_mm() const { return spacing_; }
  const std::array<std::size_t, 3>& size() const { return size_; }  ///< numbers of points along x, y, z
  /// Gy; x fastest, then y, then z.
  const std::vector<float>& dose_gy() const { return dose_; }
  Vec3 position(std::size_t i, std::size_t j, std::size_t k) const;  ///< mm
  std::size_t index(std::size_t i, std::size_t j, std::size_t k) const {
    return (k * size_[1] + j) * size_[0] + i;
  }

  /// Adds the dose of one more seed (finite; axis of unit length), where seed and points lie `stretch` times as far
  /// apart along x, y and z as they do now: in tissue that has swollen. No allocation.
  void add(const DoseSeed& seed, const Vec3& stretch = Vec3::Ones());
  /// Removes all seeds.
  void clear();

  /// Between the grid's points, Gy: 1/√dose is trilinear, as it is linear in the distance from a single source. In the
  /// outer half of the outermost voxels, the dose at the nearest position within the points; NaN farther out.
  double at(const Vec3& p) const;

 private:
  Vec3 origin_;
  double spacing_;
  std::array<std::size_t, 3> size_;
  SimdTarget target_;
  std::vector<float> dose_;
};

/// Total dose of seeds (finite; axes of unit length) at the middles of voxels that lie anywhere, as DoseGrid has it.
std::vector<float> dose_at_voxels(std::span<const DoseSeed> seeds, const VoxelGrid& grid);

}  // namespace brachy
