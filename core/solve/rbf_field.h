#pragma once

#include <span>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/kernels/kernels.h"

namespace brachy {

/// The displacement field u(X) = Σ_i α_i ψ(|X − p_i| / a) at single points, in double. The mesh's 14,560 points go
/// through BlockField. Threads: const functions may be called from any.
struct RbfField {
  Kernel kernel;
  double support_radius = 1;        ///< a, mm
  std::span<const Vec3> positions;  ///< p, n landmarks at rest, mm
  std::span<const Vec3> weights;    ///< α, n, mm (from RbfSystem::solve)

  /// u(X), mm; exactly zero farther than a from every landmark.
  Vec3 displacement(const Vec3& X) const;

  /// I + ∇u(X), with ∇u = Σ α_i ∇ψᵀ. At a landmark of ψ3,0, which has a cusp there, its own term is left out.
  Mat3 deformation_gradient(const Vec3& X) const;

  /// det(I + ∇u(X)): the local volume ratio; ≤ 0 where the field folds.
  double jacobian(const Vec3& X) const { return deformation_gradient(X).determinant(); }
};

}  // namespace brachy
