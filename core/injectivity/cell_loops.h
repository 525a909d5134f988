#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/rigid_transform.h"
#include "core/base/simd/simd_target.h"
#include "core/kernels/kernels.h"

namespace brachy {

/// Points of a cell, mm about its centre: the 27 of a lattice, 3 × 3 × 3 with x fastest, or any others.
struct CellPoints {
  static constexpr std::size_t kCount = 32;  ///< capacity
  static constexpr std::size_t kLattice = 27;
  alignas(64) float x[kCount], y[kCount], z[kCount];

  Vec3 at(std::size_t i) const { return Eigen::Vector3f(x[i], y[i], z[i]).cast<double>(); }
  void set(std::size_t i, const Vec3& p) {
    x[i] = static_cast<float>(p.x());
    y[i] = static_cast<float>(p.y());
    z[i] = static_cast<float>(p.z());
  }
};

/// ∇u at a cell's points: a[3 i + j] = ∂u_i/∂x_j.
struct CellGradients {
  alignas(64) float a[9][CellPoints::kCount];
};

/// A weight and where it acts, mm about the cell's centre; the weight over a², 1/mm.
struct CellSource {
  float x, y, z, wx, wy, wz;
};

/// Input of the bound for a cell's eighths beside the gradients at its lattice.
struct CellRemainder {
  float scale = 1;       ///< s of det(I + s ∇u)
  float error = 0;       ///< ∇u is, in each eighth, trilinear between its corners up to this (Frobenius)
  float cusp_slope = 0;  ///< a source's w gᵀ that the gradients lack, g anything with |g| ≤ cusp_slope …
  float wx = 0, wy = 0, wz = 0;  ///< … and its w
};

/// Positions in planes, mm.
struct CellPlaces {
  const float *x, *y, *z;
};

/// The inner loops of the certificate, for one instruction set. Threads: any. Real-time: no allocation.
struct CellLoops {
  /// distance[k] = that of place chosen[k] from the cube of half side `half` about (x, y, z), k < count.
  void (*distances)(const CellPlaces& places, const std::uint32_t* chosen, std::size_t count, float x,
                    float y, float z, float half, float* distance);
  /// det(I + s A) at each point.
  void (*determinants)(const CellGradients& A, float scale, float* det);
  /// A lower bound of det(I + s ∇u) over each of the eight half-sized cells of a lattice: `lower` has 16 entries, of
  /// which those in kEighths are valid.
  void (*bounds)(const CellGradients& A, const CellRemainder& remainder, float* lower);
};

/// First lattice point of each eighth of a cell; its corners are kCorners further.
inline constexpr std::size_t kEighths[8] = {0, 1, 3, 4, 9, 10, 12, 13};
inline constexpr std::size_t kCorners[8] = {0, 1, 3, 4, 9, 10, 12, 13};

const CellLoops& cell_loops(SimdTarget target);

/// A = Σ_j w_j ∇ψ(|X − p_j|/a)ᵀ; `inverse_radius` is 1/a, 1/mm.
using ScalarGradients = void (*)(const CellPoints& X, const CellSource* sources, std::size_t count,
                                 float inverse_radius, CellGradients& A);
ScalarGradients scalar_gradients(const Kernel& kernel, SimdTarget target);

}  // namespace brachy
