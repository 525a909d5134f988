#pragma once

#include <gtest/gtest.h>

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/models/tissue_field.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy::test {

/// The whole K⁻¹, 3n × 3n, from reactions to unit displacements, one landmark and axis after the other.
inline Eigen::MatrixXd inverse_by_columns(TissueField& field, std::size_t n) {
  Eigen::MatrixXd inverse(3 * static_cast<Eigen::Index>(n), 3 * static_cast<Eigen::Index>(n));
  std::vector<Vec3> d(n, Vec3::Zero()), f(n);
  for (std::size_t j = 0; j < n; ++j)
    for (Eigen::Index k = 0; k < 3; ++k) {
      d[j][k] = 1;
      field.solve(d, f);
      d[j][k] = 0;
      for (std::size_t i = 0; i < n; ++i)
        inverse.block<3, 1>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j) + k) = f[i];
    }
  return inverse;
}

inline std::vector<Vec3> random_axes(std::mt19937_64& random, std::size_t m) {
  std::vector<Vec3> axes;
  while (axes.size() < m)
    if (const Vec3 v = uniform_point(random, 1); v.norm() > 0.1) axes.push_back(v.normalized());
  return axes;
}

/// Factorizes `positions` and compares axial_stiffness of landmarks `first` … with K⁻¹ by columns, and of one
/// common axis with the force that moves all of them along it.
inline void expect_axial_stiffness(TissueField& field, std::span<const Vec3> positions,
                                   std::span<const LandmarkSpread> cores, std::size_t first) {
  ASSERT_TRUE(field.factorize(LandmarkSet::of(positions, {}, cores)));
  std::mt19937_64 random(7);
  const std::size_t n = positions.size(), m = n - first;
  const std::vector<Vec3> axes = random_axes(random, m);
  const Eigen::MatrixXd inverse = inverse_by_columns(field, n);
  Eigen::MatrixXd H(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(m));
  const std::uint64_t before = allocation_count();
  field.axial_stiffness(first, axes, H);
  EXPECT_EQ(allocation_count(), before);
  const double tolerance = 1e-9 * inverse.cwiseAbs().maxCoeff();
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < m; ++j) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      const Mat3 block = inverse.block<3, 3>(3 * static_cast<Eigen::Index>(first + i),
                                             3 * static_cast<Eigen::Index>(first + j));
      ASSERT_NEAR(H(row, column), axes[i].dot(block * axes[j]), tolerance) << i << " " << j << " of " << n;
      ASSERT_EQ(H(row, column), H(column, row));
    }

  const Vec3 axis = axes.front();
  const std::vector<Vec3> common(m, axis);
  field.axial_stiffness(first, common, H);
  std::vector<Vec3> d(n, Vec3::Zero()), f(n);
  std::fill(d.begin() + static_cast<std::ptrdiff_t>(first), d.end(), axis);
  field.solve(d, f);
  double along = 0;
  for (std::size_t i = first; i < n; ++i) along += f[i].dot(axis);
  EXPECT_NEAR(H.sum(), along, 1e-7 * H.cwiseAbs().sum());
}

/// factorize does not change the evaluated field, and update after factorize gives the same bits as update alone.
inline void expect_factorize_leaves_the_field(TissueField& field, TissueField& fresh,
                                              const RandomLandmarks& now, const RandomLandmarks& next) {
  const Vec3 X(1, 2, -3);
  const LandmarkSet first = LandmarkSet::of(now.positions, now.displacements),
                    second = LandmarkSet::of(next.positions, next.displacements);
  std::vector<Vec3> f(next.positions.size());
  ASSERT_TRUE(field.update(first));
  const Vec3 u = field.displacement_at(X);
  const std::uint32_t b = field.touched().front();
  const float shown = field.displacement(b).ux[0];
  const double force = field.total_force_n();
  const std::uint64_t before = allocation_count();
  ASSERT_TRUE(field.factorize(second));
  field.solve(next.displacements, f);
  EXPECT_EQ(allocation_count(), before);
  EXPECT_EQ(field.displacement_at(X), u);
  EXPECT_EQ(field.displacement(b).ux[0], shown);
  EXPECT_EQ(field.total_force_n(), force);
  field.rescale(0.5);
  EXPECT_LT((field.displacement_at(X) - 0.5 * u).norm(), 1e-6 * u.norm());

  std::vector<Vec3> twice = next.positions;
  twice[1] = twice[0];
  const Vec3 half = field.displacement_at(X);
  EXPECT_EQ(field.factorize(LandmarkSet::of(twice)).kind, FactorStatus::kDuplicate);
  EXPECT_EQ(field.displacement_at(X), half);

  ASSERT_TRUE(field.factorize(second));
  ASSERT_TRUE(field.update(second));
  ASSERT_TRUE(fresh.update(second));
  EXPECT_EQ(field.displacement_at(X), fresh.displacement_at(X));
  EXPECT_EQ(field.total_force_n(), fresh.total_force_n());
  Vec3 sum = Vec3::Zero();
  for (const Vec3& each : f) sum += each;
  EXPECT_NEAR(field.total_force_n(), sum.norm(), 1e-9 * sum.norm());
  ASSERT_TRUE(field.update(second));
  EXPECT_EQ(field.evaluation(), Evaluation::kIdle);
  // The field's first set again, after another one: factorized, and evaluated as before.
  ASSERT_TRUE(field.factorize(first));
  ASSERT_TRUE(field.update(second));
  EXPECT_EQ(field.displacement_at(X), fresh.displacement_at(X));
  std::vector<Vec3> again(f.size());
  field.solve(next.displacements, again);
  for (std::size_t i = 0; i < f.size(); ++i) EXPECT_LT((again[i] - f[i]).norm(), 1e-9 * f[i].norm());
}

}  // namespace brachy::test
