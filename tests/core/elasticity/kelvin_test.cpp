#include "core/elasticity/kelvin.h"

#include <gtest/gtest.h>

#include "core/elasticity/kelvin_sums.h"
#include "core/elasticity/kelvin_traction.h"

namespace brachy {
namespace {

// σ n = λ/μ div(u) n + (∇u + ∇uᵀ) n for the force along each axis, by central differences.
Mat3 traction_by_differences(const Vec3& x, const Vec3& n, double s, double poisson) {
  const double h = 1e-4;
  Mat3 T;
  for (int j = 0; j < 3; ++j) {
    Mat3 gradient;  // (i, k): ∂u_i/∂x_k
    for (int k = 0; k < 3; ++k)
      gradient.col(k) =
          (kelvin(x + h * Vec3::Unit(k), s, poisson) - kelvin(x - h * Vec3::Unit(k), s, poisson)).col(j) /
          (2 * h);
    const double lambda = 2 * poisson / (1 - 2 * poisson);
    T.col(j) = lambda * gradient.trace() * n + (gradient + gradient.transpose()) * n;
  }
  return T;
}

TEST(KelvinTraction, IsTheStressOfKelvinsSolution) {
  const Vec3 n = Vec3(0.3, -0.5, 0.8).normalized();
  for (const double poisson : {0.0, 0.3, 0.45, 0.49})
    for (const Vec3& x : {Vec3(1, 2, 3), Vec3(-0.4, 0.1, 0.2), Vec3(8, 0, 0)})
      for (const double s : {0.0, 0.5, 4.0}) {
        // of λ div(u), before it cancels
        const double scale = (1 + 2 * poisson / (1 - 2 * poisson)) / x.squaredNorm();
        EXPECT_LT((kelvin_traction(x, n, s, poisson) - traction_by_differences(x, n, s, poisson)).norm(),
                  1e-8 * scale)
            << "ν = " << poisson << ", s = " << s << ", x = " << x.transpose();
      }
}

TEST(KelvinTraction, VanishesAtTheForceItself) {
  EXPECT_EQ(kelvin_traction(Vec3::Zero(), Vec3::UnitZ(), 2, 0.49), Mat3::Zero());
}

// Over a sphere about the force the traction sums to the force, or for a spread force to its share within the sphere.
TEST(KelvinTraction, BalancesTheForce) {
  Mat3 sum = Mat3::Zero();
  const int n = 2000;
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2 * i + 1.0) / n, r = std::sqrt(1 - z * z), t = 2.399963229728653 * i;
    const Vec3 u(r * std::cos(t), r * std::sin(t), z);
    sum += kelvin_traction(5 * u, u, 0, 0.49) * 4 * std::numbers::pi * 25 / n;
  }
  EXPECT_LT((sum + Mat3::Identity()).norm(), 1e-3);
}

PointGroups some_groups() {
  PointGroups groups;
  groups.begin_group();
  groups.add({1, 2, 3}, 0.5, 0.5);
  groups.add({1, -2, 3}, 0.7, 0.25);
  groups.begin_group();
  groups.add({-4, 2, 1}, 1, 1);
  groups.finish();
  return groups;
}

TEST(KelvinSums, RowsAndColumnsAreWeightedSums) {
  const PointGroups groups = some_groups();
  const std::vector<Vec3> p = {{0, 0, 1}, {5, 0, 2}};
  const std::vector<double> s = {0.1, 0.2};
  const Eigen::MatrixXd rows = kelvin_rows(p, s, groups, 0.45), K = kelvin_between(groups, groups, 0.45);
  EXPECT_LT((rows.block<3, 3>(3, 0) - 0.5 * kelvin(p[1] - groups.points[0], s[1] + 0.5, 0.45) -
             0.25 * kelvin(p[1] - groups.points[1], s[1] + 0.7, 0.45))
                .norm(),
            1e-15);
  EXPECT_LT((K.block<3, 3>(0, 3) - 0.5 * kelvin(groups.points[0] - groups.points[2], 1.5, 0.45) -
             0.25 * kelvin(groups.points[1] - groups.points[2], 1.7, 0.45))
                .norm(),
            1e-15);
  EXPECT_LT((K - K.transpose()).norm(), 1e-15);
}

TEST(KelvinSums, FieldsAreTheRowsTimesTheForces) {
  std::vector<Vec3> X;
  for (int i = 0; i < 70; ++i) X.push_back({0.3 * i, 5 - 0.1 * i, 0.01 * i * i});  // a block of 64 and some
  const PointGroups groups = some_groups();
  const Eigen::MatrixXd forces = Eigen::MatrixXd::Random(9, 3);
  const Eigen::MatrixXd u = kelvin_fields(X, groups.points, groups.s, forces, 0.49);
  ASSERT_EQ(u.rows(), 210);
  ASSERT_EQ(u.cols(), 3);
  for (std::size_t i = 0; i < X.size(); ++i) {
    Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
    for (std::size_t j = 0; j < 3; ++j)
      expected += kelvin(X[i] - groups.points[j], groups.s[j], 0.49) *
                  forces.middleRows<3>(3 * static_cast<Eigen::Index>(j));
    EXPECT_LT((u.middleRows<3>(3 * static_cast<Eigen::Index>(i)) - expected).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace brachy
