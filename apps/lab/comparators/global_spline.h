#pragma once

#include <functional>
#include <memory>

#include <Eigen/Core>
#include <Eigen/LU>

#include "apps/lab/comparators/compared_model.h"

namespace brachy {

/// An interpolant without bounded support, u(x) = Σ α_i φ(|x − p_i|) + p(x), Σ α_i q(p_i) = 0 for every polynomial q of
/// p's degree. Directions in which the landmarks do not spread (a straight shaft, a single contact) are left out of p,
/// which would otherwise be undetermined.
struct SplineBasis {
  std::function<double(double)> phi;  ///< of the distance, mm
  int degree = 0;                     ///< of p: 0 constant, 1 affine

  /// φ(r) = r, −8π times the fundamental solution of Δ²: the interpolant of least bending in space, with an affine
  /// part (J. Duchon 1977; F. L. Bookstein, IEEE PAMI 11 (1989) 567).
  static SplineBasis thin_plate();
  /// φ(r) = √(r² + c²), c in mm, with a constant part (R. L. Hardy, J. Geophys. Res. 76 (1971) 1905; of order 1:
  /// C. A. Micchelli, Constr. Approx. 2 (1986) 11).
  static SplineBasis multiquadric(double c);
};

/// The linear map from the displacements of m landmarks to those of any point, in double.
class SplineMap {
 public:
  /// `positions` (n, mm), of which all but the first m are fixed. Throws std::runtime_error where two of them coincide.
  SplineMap(SplineBasis basis, std::vector<Vec3> positions, std::size_t m);

  /// The displacements at X for unit displacements of the m landmarks: |X| × m, dimensionless.
  Eigen::MatrixXd influence(std::span<const Vec3> X) const;

  /// The inverted matrix, (n + q) × (n + q): φ between the landmarks, bordered by p's q terms. Assembled on each call.
  Eigen::MatrixXd matrix() const;

 private:
  Eigen::RowVectorXd basis_at(const Vec3& x) const;

  SplineBasis basis_;
  std::vector<Vec3> positions_;
  Vec3 centre_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> directions_;  // in which the landmarks spread; rows, 1/mm
  Eigen::MatrixXd weights_;                              // (n + q) × m: α and p of unit displacements
};

/// Thin-plate spline or multiquadric at its fastest: the influence of the landmarks on the points is tabulated in
/// set-up (in float), a tick multiplies. `holds_walls`: 5 × 5 points of each held face are landmarks too, which do not
/// move.
class GlobalSpline : public ComparedModel {
 public:
  GlobalSpline(SplineBasis basis, bool holds_walls) : basis_(std::move(basis)), holds_walls_(holds_walls) {}

  void set_up(const ComparedScene& scene) override;
  void tick(std::span<const Vec3> displacements) override;
  void read(std::span<Vec3> u) const override;
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override;

 private:
  SplineBasis basis_;
  bool holds_walls_;
  std::unique_ptr<const SplineMap> map_;
  Eigen::MatrixXf influence_;                       // N × m
  Eigen::Matrix<float, Eigen::Dynamic, 3> moving_;  // m × 3, mm
  Eigen::Matrix<float, Eigen::Dynamic, 3> u_;       // N × 3, mm
};

/// The centres of `per_side`² cells of every held face, mm.
std::vector<Vec3> wall_points(const ElasticBody& body, int per_side = 5);

}  // namespace brachy
