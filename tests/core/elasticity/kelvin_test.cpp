#include "core/elasticity/kelvin.h"

#include <gtest/gtest.h>

#include "core/elasticity/kelvin_sums.h"

namespace brachy {
namespace {

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
