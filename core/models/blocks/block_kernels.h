#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/simd/simd_target.h"
#include "core/geometry/tissue/tissue.h"
#include "core/kernels/kernels.h"

namespace brachy {

/// Coordinates of a block's points: three planes of kBlockSize, relative to the block's centre, in support radii.
/// A short block's tail repeats its first point.
template <class T>
struct BlockPoints {
  alignas(64) T x[Tissue::kBlockSize], y[Tissue::kBlockSize], z[Tissue::kBlockSize];
};

/// Displacements of a block's points: three planes of kBlockSize, mm.
template <class T>
struct BlockDisplacement {
  alignas(64) T ux[Tissue::kBlockSize], uy[Tissue::kBlockSize], uz[Tissue::kBlockSize];

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(ux, uy, uz);
  }
};

/// Neighbours that share a list of landmarks where points are sparse: one AVX-512 vector.
constexpr std::size_t kGroupSize = 16;
constexpr std::size_t kGroupsInBlock = Tissue::kBlockSize / kGroupSize;
static_assert(Tissue::kBlockSize % kGroupSize == 0);

/// A landmark in the coordinates of one cluster: position relative to the cluster's centre in support radii, weight
/// in mm.
template <class T>
struct LocalLandmark {
  T x = 0, y = 0, z = 0;
  T wx = 0, wy = 0, wz = 0;
};

/// The same positions in planes, padded to a multiple of kGroupSize with positions that are out of reach.
struct LandmarkPlanes {
  const float *x, *y, *z;
  std::size_t count;
};

/// A box about points, in the coordinates of their cluster.
struct LocalBox {
  float min[3], max[3];
};

/// The inner loops, for one kernel and one instruction set. `chosen` has space for kSpare more than the landmarks.
/// Threads: any. Real-time: no allocation.
struct BlockKernels {
  static constexpr std::size_t kSpare = kGroupSize;

  /// The landmarks nearer than 1 to the box, ascending, into `chosen`; returns how many.
  std::size_t (*choose)(const LandmarkPlanes& planes, const LocalBox& box, std::uint32_t* chosen);
  using DirectFloat = std::size_t (*)(const BlockPoints<float>& X, const LocalBox* boxes,
                                      const LandmarkPlanes& planes, const LocalLandmark<float>* landmarks,
                                      std::uint32_t* chosen, BlockDisplacement<float>& u);
  /// u = Σ_j ψ(|X − p_j|/a) w_j for a block, each group over the landmarks that reach its own box, in their order.
  /// Returns the number of pairs of a point and a landmark.
  DirectFloat direct_by_group;
  /// The same, all the block over the landmarks that reach the one box: where blocks are small beside the support.
  DirectFloat direct_by_block;
  /// The same in double for one group, that of the points from `first`, over the `count` ≥ 1 landmarks chosen.
  void (*direct_double)(const BlockPoints<double>& X, std::size_t first,
                        const LocalLandmark<double>* landmarks, const std::uint32_t* chosen,
                        std::size_t count, BlockDisplacement<double>& u);
  /// u = Σ_m columns[m] d_m for a block: m planes of kBlockSize, d as m × 3 (mm).
  void (*condensed)(const float* columns, const float* d, std::size_t m, BlockDisplacement<float>& u);
  /// columns[k] += ψ(|X − p|/a) z[k], k < m, in double: one landmark's share of a block's condensed columns.
  void (*condense)(const BlockPoints<double>& X, double x, double y, double z, const double* shares,
                   std::size_t m, double* columns);
};

/// The loops for `kernel` on `target`, which this processor must support.
const BlockKernels& block_kernels(const Kernel& kernel, SimdTarget target);

}  // namespace brachy
