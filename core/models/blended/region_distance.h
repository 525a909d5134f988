#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"
#include "core/injectivity/cell_loops.h"

namespace brachy {

inline constexpr double kHuge = 1e30;  ///< a bound that is not known; products of a few are still finite

/// Bounds of a distance over a ball.
struct DistanceBounds {
  double least = 0, most = 0;  ///< mm
  /// The first three derivatives along any unit vector are at most this, 1, 1/mm, 1/mm²; the second and third where the
  /// distance is within half a blend.
  std::array<double, 3> slope{};
};

/// A distance, mm, and its gradient at a cell's points.
struct CellDistances {
  alignas(64) float d[CellPoints::kCount], g[3][CellPoints::kCount];
};

/// A region in the form that a membership requires: the distance from its surface, mm, negative inside, twice
/// continuously differentiable but deep inside. Threads: const functions from any. Real-time: they do not allocate.
class RegionDistance {
 public:
  virtual ~RegionDistance() = default;
  /// At X, and the gradient there unless it is null.
  virtual double at(const Vec3& X, Vec3* gradient = nullptr) const noexcept = 0;
  /// The same at points about `centre`, in single precision.
  virtual void at(const Vec3& centre, const CellPoints& X, CellDistances& distances) const noexcept = 0;
  /// The work of that, in pairs of InjectivitySearch: 15 ns.
  virtual std::size_t work() const = 0;
  /// Over the ball of `radius` about X, mm.
  virtual DistanceBounds over(const Vec3& X, double radius) const noexcept = 0;
};

/// Of an ellipsoid with axes along x, y, z, or a sphere, to first order: k(k−1)/|z| with y = x/a, k = |y|, z
/// = y/a (G. Taubin, IEEE TPAMI 13 (1991) 1115, for k − 1). Exact on the surface and for a sphere; smooth but
/// at the centre; inside at least
/// (1 − k) min a deep.
class EllipsoidDistance : public RegionDistance {
 public:
  EllipsoidDistance(const Vec3& centre, const Vec3& semi_axes);
  double at(const Vec3& X, Vec3* gradient = nullptr) const noexcept override;
  void at(const Vec3& centre, const CellPoints& X, CellDistances& distances) const noexcept override;
  std::size_t work() const override { return 10; }
  DistanceBounds over(const Vec3& X, double radius) const noexcept override;

 private:
  Vec3 centre_, semi_axes_;
  /// Of k²/|z| and k/|z|, homogeneous of degree 1 and 0: their derivatives' largest at |x| = 1.
  std::array<double, 3> linear_{}, constant_{};
};

/// Of a closed, outward surface, smoothed: the uniform cubic B-spline over exact distances at the nodes of a
/// grid, off by an eighth of a cell where the surface's radius is three cells, less where it is flatter.
/// Constant far outside.
class SampledDistance : public RegionDistance {
 public:
  /// along the longest side, which bounds memory and time: some tenths of a second
  static constexpr double kMostCells = 48;

  /// `blend_mm`: what the nodes are to resolve, by four cells if kMostCells allow.
  SampledDistance(const SurfaceBvh& surface, double blend_mm);
  double at(const Vec3& X, Vec3* gradient = nullptr) const noexcept override;
  void at(const Vec3& centre, const CellPoints& X, CellDistances& distances) const noexcept override;
  std::size_t work() const override { return 150; }
  DistanceBounds over(const Vec3& X, double radius) const noexcept override;

 private:
  using Slopes = std::array<float, 3>;
  std::size_t node(std::size_t x, std::size_t y, std::size_t z) const {
    return x + count_[0] * (y + count_[1] * z);
  }
  bool locate(const Vec3& X, std::array<std::size_t, 3>& cell, Vec3& t) const noexcept;
  template <class T>
  T spline(std::size_t first, const Vec3& t, T* gradient) const noexcept;
  Slopes slopes_of(std::size_t x, std::size_t y, std::size_t z) const;

  Vec3 min_;
  double spacing_, margin_;
  std::array<std::size_t, 3> count_{};  // nodes; a cell's are those from its own to three further
  std::vector<float> nodes_;
  std::vector<Slopes> slopes_;  // of each cell, by its first node
  Slopes largest_{};
};

}  // namespace brachy
