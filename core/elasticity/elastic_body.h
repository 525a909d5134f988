#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// A point of a region's surface that stands for a patch of it.
struct SurfacePatch {
  Vec3 position, normal;  ///< mm; outward, unit
  double area;            ///< mm²
};

/// A part of the body with a modulus of its own: a gland, a tumour.
class Region {
 public:
  virtual ~Region() = default;
  /// 1 inside, 0 outside, ½ on the surface itself (within 1e-4 of its size).
  virtual double inside_share(const Vec3& X) const = 0;
  /// About n points of the surface, spread evenly by area.
  virtual std::vector<SurfacePatch> surface(std::size_t n) const = 0;

  double shear_modulus = 1;  ///< N/mm²
};

/// Axes along x, y, z; mm.
class EllipsoidRegion : public Region {
 public:
  EllipsoidRegion(const Vec3& centre, const Vec3& semi_axes, double shear_modulus);
  double inside_share(const Vec3& X) const override;
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
  std::vector<SurfacePatch> surface(std::size_t n) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Faces of the box, in the order in which `held` lists them.
inline constexpr std::array<const char*, 6> kFaceNames = {"-x", "+x", "-y", "+y", "-z", "+z"};

/// What is known of the body around the needle: a box of tissue, held at some faces (displacement 0) and free at the
/// others (traction 0), with regions of another shear modulus in it. Linear, isotropic; one Poisson's ratio.
struct ElasticBody {
  Vec3 box_centre = Vec3::Zero(), box_size = Vec3::Constant(96);    ///< mm
  std::array<bool, 6> held = {true, true, true, true, true, true};  ///< by kFaceNames
  double shear_modulus = 2e-3;                                      ///< of what is in no region, N/mm²
  double poisson = 0.49;                                            ///< in [0, 0.4995]
  std::vector<std::shared_ptr<const Region>> regions;               ///< a later one lies over an earlier one
  double needle_radius = 0.635;                                     ///< mm

  /// Shear moduli relative to what is in no region: materials()[0] = 1, then each region's.
  std::vector<double> materials() const;
  /// Share of each material at X, summing to 1: one of them 1, or on a region's surface half of each side.
  void material_shares(const Vec3& X, std::span<double> shares) const;

  /// The modulus at X relative to what is in no region; on a region's surface the mean of its sides. Does not allocate.
  double relative_modulus(const Vec3& X) const;

  /// Outward normal of face f, and its centre.
  static Vec3 face_normal(std::size_t f);
  Vec3 face_centre(std::size_t f) const;
};

}  // namespace brachy
