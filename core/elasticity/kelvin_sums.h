#pragma once

#include <span>

#include <Eigen/Core>

#include "core/kernels/point_groups.h"

namespace brachy {

/// Kelvin's G (kelvin.h) between many points, in the three shapes that kernels of an elastic body need. Threads:
/// one each.

/// Displacements at points `p` (n, mm; s of each, mm²) of unit forces on groups: 3n × 3|groups|, columns weighted sums
/// over the groups' points, each with its smooth_s: for what a remainder makes of them (remainder.h).
Eigen::MatrixXd kelvin_rows(std::span<const Vec3> p, std::span<const double> s, const PointGroups& groups,
                            double poisson);

/// The same with rows that are weighted sums too: 3|a| × 3|b|.
Eigen::MatrixXd kelvin_between(const PointGroups& a, const PointGroups& b, double poisson);

/// Displacements at the points X, where s = 0, of m sets of forces (3n × m) at points `p`: 3|X| × m. No matrix is made:
/// some 10 ns a pair for m = 2.
Eigen::MatrixXd kelvin_fields(std::span<const Vec3> X, std::span<const Vec3> p, std::span<const double> s,
                              const Eigen::MatrixXd& forces, double poisson);

}  // namespace brachy
