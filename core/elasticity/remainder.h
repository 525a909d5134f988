#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/kernels/point_groups.h"

namespace brachy {

/// What bounds and regions add to the Kelvin solution. The kernel of an elastic body is
///
///     C(x, y) = w(x, y) [ G(x, y) − Q(x, y) ] + P(x, y)
///
/// G of kelvin.h; Q, `held`: what G would do at the bounds (and at a region's surface), taken back; P, `motion`: the
/// compliance of what moves there. w = 2/(k(x) + k(y)), k the modulus at a point over that outside all regions, on a
/// region's surface the mean of its sides: each material has its own modulus. G − Q and P are positive
/// semidefinite, and so is w, a Cauchy matrix; then w ∘ (G − Q) is (Schur's product) and C is a covariance, like
/// every model's kernel. P − wQ is smooth except near a region's surface. All for shear modulus 1 outside; divide
/// by μ.
/// Threads: const functions may be called from any. They allocate.
class Remainder {
 public:
  struct Parts {
    Eigen::MatrixXd held;    ///< Q
    Eigen::MatrixXd motion;  ///< P; empty: 0
  };
  virtual ~Remainder() = default;

  /// Between groups: 3|a| × 3|b|, rows and columns weighted sums over the groups' points.
  virtual Parts between(const PointGroups& a, const PointGroups& b) const = 0;

  /// Q f and P f at the points X: 3|X| × m, for m sets of forces on groups b (3|b| × m).
  virtual Parts fields(std::span<const Vec3> X, const PointGroups& b,
                       const Eigen::MatrixXd& forces) const = 0;

  /// Planes along x, y and z between which P and Q are trilinear, if they are; empty: they are smooth.
  virtual std::array<std::vector<double>, 3> planes() const { return {}; }

  /// What it keeps, B.
  virtual std::size_t bytes() const = 0;
};

}  // namespace brachy
