#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// A model with its parameters, for landmarks that were measured and so carry noise.
struct BeadKernel {
  std::string model;                                       ///< the model's name
  std::vector<std::pair<std::string, double>> parameters;  ///< lengths in mm
  std::function<Mat3(const Vec3&)> value;                  ///< C of two points with this difference, mm
  bool is_scalar = false;                                  ///< C = c I: the three components are solved alike
};

/// Every deformation model that needs no boundary, each at a few lengths in units of `extent` (mm, the landmarks'
/// size): the ψ kernels (support), compact_elastic (wall, core), elastic (core, Poisson's ratio).
std::vector<BeadKernel> bead_kernels(double extent);

/// u(X) = C(X, ·) y + an affine map or none, with (C + λ c̄ I) y = d − affine, c̄ the mean diagonal of C: kriging of
/// noisy landmarks (G. Wahba, Spline Models for Observational Data, SIAM 1990, chapters 1 and 4). λ = 0 interpolates.
/// C is decomposed once, so that any smoothing costs little more. Threads: one. It allocates.
class BeadModel {
 public:
  struct Smoothing {
    double lambda = 1e-3;  ///< > 0, noise variance over signal variance
    bool affine = false;
  };

  /// Landmarks at rest positions (n ≥ 5, not coplanar, mm).
  BeadModel(const BeadKernel& kernel, std::span<const Vec3> landmarks);

  /// Root mean square distance, mm, between `displacements` (n, mm) and the prediction from all other landmarks.
  double leave_one_out(std::span<const Vec3> displacements, const Smoothing& smoothing) const;

  /// u at X, mm, of the landmarks' displacements (n, mm).
  std::vector<Vec3> evaluate(std::span<const Vec3> X, std::span<const Vec3> displacements,
                             const Smoothing& smoothing) const;

 private:
  struct Solution {
    Eigen::VectorXd shrink;        // 1/(eigenvalue + λ), cn
    Eigen::MatrixXd weights;       // y, cn × 3/c
    Eigen::MatrixXd coefficients;  // of the affine map, 4c × 3/c
    Eigen::MatrixXd gram;          // inverse of its normal matrix, 4c × 4c
  };
  Eigen::MatrixXd affine_basis(std::span<const Vec3> X) const;   // c|X| × 4c
  Eigen::MatrixXd kernel_matrix(std::span<const Vec3> X) const;  // c|X| × cn
  Solution solve(std::span<const Vec3> displacements, const Smoothing& smoothing) const;

  const BeadKernel& kernel_;
  std::vector<Vec3> landmarks_;
  Eigen::Index c_;  // 1 or 3: rows a landmark
  Vec3 centre_;
  double extent_, scale_ = 1;  // mm; 1/c̄
  Eigen::VectorXd eigenvalues_;
  Eigen::MatrixXd vectors_, basis_;  // basis_ = vectors_ᵀ × the landmarks' affine basis
};

}  // namespace brachy
