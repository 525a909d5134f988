#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/simd/simd_target.h"
#include "core/injectivity/cell_loops.h"
#include "core/models/blocks/block_kernels.h"

namespace brachy {

/// A force and where it acts, in the coordinates of a block (mm about its centre).
struct NearSource {
  float x, y, z, s;     ///< s: c²/2 of the source and of what it is looked at from, mm² (kelvin.h)
  float fx, fy, fz, _;  ///< force over 4πμ times the modulus weight, mm²
};

/// The compact kernels, Σ_k w_k ψ31(r/a_k) I + v_k Φ(x/a_k) (core/DESIGN.md, section 3), in float.
struct CompactShape {
  static constexpr std::size_t kMaxSupports = 8;
  std::size_t count = 0;
  std::array<float, kMaxSupports> inverse_radius{}, w{}, v{};
};

/// Where a point lies in a grid of nodes, and its cubic weights along each axis.
struct GridPoint {
  std::uint32_t base = 0;  ///< index of the first of 4 × 4 × 4 nodes
  std::array<float, 4> wx{}, wy{}, wz{};
};

/// The inner loops of the matrix models' tick, for one instruction set. Threads: any. Real-time: no allocation.
struct NearLoops {
  /// u += Σ_j [(1−b)/r + s/(2r³)] f_j + b x (x·f_j)/r³, r² = |x|² + s_j: Kelvin's solution (kelvin.h).
  void (*kelvin)(const BlockPoints<float>& X, const NearSource* sources, std::size_t count, float b,
                 BlockDisplacement<float>& u);
  /// u += Σ_j [φ(r) I + …] f_j for a compact kernel; s is not used.
  void (*compact)(const BlockPoints<float>& X, const NearSource* sources, std::size_t count,
                  const CompactShape& shape, BlockDisplacement<float>& u);
  /// A += the gradients of these two.
  void (*kelvin_gradients)(const CellPoints& X, const NearSource* sources, std::size_t count, float b,
                           CellGradients& A);
  void (*compact_gradients)(const CellPoints& X, const NearSource* sources, std::size_t count,
                            const CompactShape& shape, CellGradients& A);
  /// u = Σ_nodes weight · value for `count` points. Values are interleaved x, y, z, x fastest; `row` and
  /// `slice` are the numbers of floats to the next y and z. Four floats beyond a row may be read.
  void (*interpolate)(const float* values, std::size_t row, std::size_t slice, const GridPoint* points,
                      std::size_t count, BlockDisplacement<float>& u);
  /// y += a x, n floats.
  void (*axpy)(float a, const float* x, float* y, std::size_t n);
};

/// The loops for `target`, which must be supported by this processor.
const NearLoops& near_loops(SimdTarget target);

}  // namespace brachy
