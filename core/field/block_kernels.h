#pragma once

#include <cstddef>

#include "core/field/simd_target.h"
#include "core/kernels/kernels.h"
#include "core/tissue/tissue.h"

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
};

/// A landmark as one block sees it: place relative to the block's centre in support radii, weight in mm.
template <class T>
struct BlockLandmark {
  T x, y, z;
  T wx, wy, wz;
};

/// The inner loops over one block, for one kernel and one instruction set. No bounds, no branches on data.
/// Threads: any. Real-time: no allocation.
struct BlockKernels {
  /// u = Σ_j ψ(|X − p_j|/a) w_j over n landmarks, in their order.
  void (*direct_float)(const BlockPoints<float>& X, const BlockLandmark<float>* landmarks, std::size_t n,
                       BlockDisplacement<float>& u);
  /// The same in double.
  void (*direct_double)(const BlockPoints<double>& X, const BlockLandmark<double>* landmarks, std::size_t n,
                        BlockDisplacement<double>& u);
  /// u = Σ_m columns[m] d_m: m planes of kBlockSize, d as m × 3 (mm).
  void (*condensed)(const float* columns, const float* d, std::size_t m, BlockDisplacement<float>& u);
  /// columns[k] += ψ(|X − p|/a) z[k], k < m, in double: one landmark's share of the condensed columns.
  void (*condense)(const BlockPoints<double>& X, double x, double y, double z, const double* shares,
                   std::size_t m, double* columns);
};

/// The loops for `kernel` on `target`, which this processor must support.
const BlockKernels& block_kernels(const Kernel& kernel, SimdTarget target);

}  // namespace brachy
