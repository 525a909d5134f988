#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/lab/stability/det_search.h"
#include "apps/lab/stability/stability_scene.h"
#include "core/kernels/kernels.h"

namespace brachy {

/// Landmarks at rest (mm) and how far each goes with a push of 1 mm; a held one does not.
struct PushedLandmarks {
  std::vector<Vec3> positions, directions;
  std::size_t on_shaft = 0;  ///< this many of the first are a needle's shaft

  void add(const Vec3& position, const Vec3& direction) {
    positions.push_back(position);
    directions.push_back(direction);
  }
};

/// `n` landmarks along z about `middle`, the tip first (highest), all pushed along `direction`.
PushedLandmarks pushed_shaft(const Vec3& middle, std::size_t n, double spacing, const Vec3& direction);

/// The field of a ψ kernel; none where the landmarks are singular.
Gradients psi_gradients(const Kernel& kernel, double support, const PushedLandmarks& landmarks);
/// The field of a matrix kernel, by central differences; none where the landmarks are singular. It must outlive the
/// result.
Gradients matrix_gradients(const MatrixKernel& kernel, const PushedLandmarks& landmarks);
/// ∇u by central differences over 2·10⁻³ mm of `displacements`, mm, of a push of 1 mm.
Gradients gradients_by_differences(std::function<std::vector<Vec3>(std::span<const Vec3>)> displacements);

/// A field of landmarks under an increasing push.
struct PushedField {
  std::function<double(double push)> least_det;  ///< det(I + ∇u) at a push, mm; none: there is no field
  std::function<std::optional<double>(double most_push)>
      fold;  ///< the least push that folds it, mm, if one does

  explicit operator bool() const { return static_cast<bool>(least_det); }
};

/// Of gradients that are linear in the push (none: no field), searched at `samples`; `reach` and `counts` as
/// DetSearch has them.
PushedField linear_field(Gradients gradients, std::vector<Vec3> samples, double reach,
                         DetSearch::Counts counts = {});

/// A method, for the sweeps over pushes.
struct PushedMethod {
  std::string name;
  std::function<PushedField(const PushedLandmarks&)> field;
};

/// The ψ kernels with support `support`, mm.
std::vector<PushedMethod> psi_methods(double support);
/// The matrix models, the splines with walls held, the springs and ChainMail, in the scene's body. It must outlive
/// them.
std::vector<PushedMethod> other_methods(StabilityScene& scene);

}  // namespace brachy
