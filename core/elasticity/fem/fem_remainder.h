#pragma once

#include <optional>

#include "core/elasticity/elastic_body.h"
#include "core/elasticity/fem/hex_mesh.h"
#include "core/elasticity/fem/mesh_system.h"
#include "core/elasticity/remainder.h"

namespace brachy {

struct FemOptions {
  MeshSizes sizes;
  std::optional<MeshBounds> tissue;  ///< for which it is used (mesh_planes)
  SimdTarget target = best_simd_target();
};

/// Bounds and regions by finite elements, the needle's surroundings by Kelvin's solution: a subtraction method. One
/// rectilinear mesh of the box, factored twice:
///
/// P, `motion`: the compliance of the mesh with every region's modulus, held where the body is.
/// Q, `held`: what the same cells make of Kelvin's solution, without regions, one more cell beyond every wall and there
///     Kelvin's displacement itself.
///
/// So G − Q is what the mesh cannot resolve, a few cells wide, and C = w (G − Q) + P has the exact singular field
/// with the modulus of the place and the mesh's answer for everything else: at 250 cells in the gland (5–6 mm)
/// within 2–4 % of references with shafts 0.8–2 mm thick, where P alone is off by 20–120 %.
///
/// P is symmetric. Q(a, b) is not quite (10⁻⁴ to 3·10⁻³ of C), since Kelvin's solution about b is interpolated at the
/// outer cells and that about a is not: the parts are as b's forces give them, in `between` as in `fields`.
/// Points outside the box are taken to its nearest point (a shaft leaves through a wall).
class FemRemainder : public Remainder {
 public:
  explicit FemRemainder(const ElasticBody& body, const FemOptions& options = {});

  Parts between(const PointGroups& a, const PointGroups& b) const override;
  Parts fields(std::span<const Vec3> X, const PointGroups& b, const Eigen::MatrixXd& forces) const override;
  std::array<std::vector<double>, 3> planes() const override { return tissue_.mesh().all_planes(); }
  std::size_t bytes() const override { return tissue_.bytes() + unbounded_.bytes(); }

  const MeshSystem& tissue() const { return tissue_; }

 private:
  /// What acts on the mesh: a point of core s as six points at √(3s/2) from it, the mean distance (rms) of Kelvin's
  /// regularised force 15 s² / 8π(r² + s)^7/2; none outside the box.
  PointGroups loads(const PointGroups& groups) const;
  MeshSystem::FixedMotion kelvin_motion() const;

  Vec3 min_, max_;
  double poisson_;
  MeshSystem tissue_, unbounded_;
};

}  // namespace brachy
