#pragma once

#include <memory>
#include <vector>

#include "core/math/rigid_transform.h"
#include "core/surface/surface_mesh.h"

namespace brachy {

/// A point of a region's surface that stands for a patch of it.
struct SurfacePatch {
  Vec3 position, normal;  ///< mm; outward, unit
  double area;            ///< mm²
};

/// A part of the tissue that differs from the rest: a gland, a tumour. Threads: const functions from any.
class Region {
 public:
  virtual ~Region() = default;
  /// 1 inside, 0 outside, ½ on the surface itself (within 1e-4 of its size).
  virtual double inside_share(const Vec3& X) const = 0;
  /// Distance of X from the surface, mm, negative inside, and its gradient if asked for. Real-time: does not allocate.
  virtual double signed_distance(const Vec3& X, Vec3* gradient = nullptr) const noexcept = 0;
  /// About n points of the surface, spread evenly by area.
  virtual std::vector<SurfacePatch> surface(std::size_t n) const = 0;

  double shear_modulus = 1;  ///< N/mm²
};

/// Axes along x, y, z; mm. A sphere has three equal ones.
class EllipsoidRegion : public Region {
 public:
  EllipsoidRegion(const Vec3& centre, const Vec3& semi_axes, double shear_modulus);
  double inside_share(const Vec3& X) const override;
  /// To first order, k(k−1)/|z| with y = x/a, k = |y|, z = y/a (G. Taubin, IEEE TPAMI 13 (1991) 1115, on k − 1): exact on the
  /// surface and for a sphere. Smooth but at the centre; inside, at least (1 − k) min a deep.
  double signed_distance(const Vec3& X, Vec3* gradient = nullptr) const noexcept override;
  std::vector<SurfacePatch> surface(std::size_t n) const override;

 private:
  Vec3 centre_, semi_axes_;
};

/// The inside of a closed, outward surface (mm).
class MeshRegion : public Region {
 public:
  MeshRegion(SurfaceMesh surface, double shear_modulus);
  ~MeshRegion() override;
  double inside_share(const Vec3& X) const override;
  /// Exact; its gradient jumps where two parts of the surface are equally near.
  double signed_distance(const Vec3& X, Vec3* gradient = nullptr) const noexcept override;
  std::vector<SurfacePatch> surface(std::size_t n) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy
