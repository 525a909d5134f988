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

/// Sixteen forces as the bounds of their fields need them; those of size 0 are none. A ring's stands for its points.
struct alignas(64) BoundedForces {
  static constexpr std::size_t kCount = 16;
  using Lanes = std::array<float, kCount>;
  static constexpr Lanes ones() {
    Lanes lanes{};
    lanes.fill(1);
    return lanes;
  }
  Lanes x{}, y{}, z{};     ///< where, mm
  Lanes s = ones();        ///< mm²
  Lanes ring2{};           ///< square of the ring's radius, mm²; 0: a point
  Lanes size{};            ///< near_bounds.h's unit force times this
  Lanes fx{}, fy{}, fz{};  ///< direction
  Lanes aside{};           ///< mm: how far along it the points lie that carry it
  Lanes cubed{};  ///< the mean of 1/d³ over these is at most that of 1/d² to the power of 3/2, times this
  struct Middle {
    Lanes x{}, y{}, z{};
  };
  Middle piece;      ///< middle of the piece that it belongs to, mm …
  Lanes far2{};      ///< … which is far from this square of a distance on, mm²
  Lanes is_piece{};  ///< 1: it counts where its piece is far, 0: where it is not
  Lanes points{};    ///< of the ring, 1 for a point
};

/// Sixteen corrections (PointCore::of_correction), as above.
struct alignas(64) BoundedCorrections {
  static constexpr std::size_t kCount = BoundedForces::kCount;
  using Lanes = BoundedForces::Lanes;
  Lanes x{}, y{}, z{}, s = BoundedForces::ones(), counter_s = s, size{};
};

/// What bounds one force's field by Kelvin's solution (near_bounds.h), and what is asked.
struct BoundedCell {
  float x = 0, y = 0, z = 0, half = 0;  ///< cube, mm
  float clearance2 = 0;                 ///< mm²: what is asked lies no nearer to a ring's centre
  float far2 = 0;                       ///< mm²: from here on a ring is its centre
};
struct KelvinBounds {
  float slope = 0, squeeze = 0, curvature = 0;                 ///< times powers of r² + s
  float shrink = 0, stretch = 0;                               ///< (1 − 2b)/4π, b/4π
  float pair_slope = 0, pair_squeeze = 0, pair_curvature = 0;  ///< of a correction
};
struct BoundSums {
  float slope = 0, squeeze = 0, shrink = 0;
};
struct CurvatureSums {
  float curvature = 0, work = 0;
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
  /// The same at the first kFew points only.
  static constexpr std::size_t kFew = 16;
  void (*kelvin_few)(const BlockPoints<float>& X, const NearSource* sources, std::size_t count, float b,
                     BlockDisplacement<float>& u);
  /// u += Σ_j [φ(r) I + …] f_j for a compact kernel; s is not used.
  void (*compact)(const BlockPoints<float>& X, const NearSource* sources, std::size_t count,
                  const CompactShape& shape, BlockDisplacement<float>& u);
  /// A += the gradients of these two.
  void (*kelvin_gradients)(const CellPoints& X, const NearSource* sources, std::size_t count, float b,
                           CellGradients& A);
  void (*compact_gradients)(const CellPoints& X, const NearSource* sources, std::size_t count,
                            const CompactShape& shape, CellGradients& A);
  /// Sums of the bounds over a cell (CellBounds), by groups of forces and of corrections.
  BoundSums (*kelvin_bounds)(const BoundedForces* forces, std::size_t groups, const KelvinBounds& kelvin,
                             const BoundedCell& cell);
  BoundSums (*correction_bounds)(const BoundedCorrections* corrections, std::size_t groups,
                                 const KelvinBounds& kelvin, const BoundedCell& cell);
  /// What only cells that are evaluated point by point are asked for: curvature, and of forces the gradients' work.
  CurvatureSums (*kelvin_curvatures)(const BoundedForces* forces, std::size_t groups,
                                     const KelvinBounds& kelvin, const BoundedCell& cell);
  float (*correction_curvatures)(const BoundedCorrections* corrections, std::size_t groups,
                                 const KelvinBounds& kelvin, const BoundedCell& cell);
  /// u = Σ_nodes weight · value for `count` points. Values are interleaved x, y, z, x fastest; `row` and
  /// `slice` are the numbers of floats to the next y and z. Four floats beyond a row may be read.
  void (*interpolate)(const float* values, std::size_t row, std::size_t slice, const GridPoint* points,
                      std::size_t count, BlockDisplacement<float>& u);
  /// u = q₀ + Σ q_k x_k + Σ q_kk x_k² + q_xy x y + q_yz y z + q_zx z x: coefficients in this order, as rows of three.
  void (*quadratic)(const BlockPoints<float>& X, const float (*q)[3], BlockDisplacement<float>& u);
  /// y += a x, n floats.
  void (*axpy)(float a, const float* x, float* y, std::size_t n);
};

/// The loops for `target`, which must be supported by this processor.
const NearLoops& near_loops(SimdTarget target);

}  // namespace brachy
