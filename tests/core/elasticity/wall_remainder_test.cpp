#include "core/elasticity/wall_remainder.h"

#include <gtest/gtest.h>

#include <random>

#include "core/elasticity/kelvin_sums.h"
#include "tests/core/elasticity/symmetric_eigenvalues.h"

namespace brachy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// The stored scenes' box, 96 mm.
ElasticBody even_body() {
  ElasticBody body;
  body.poisson = 0.45;
  body.shear_modulus = 2e-3;
  return body;
}

PointGroups random_points(std::size_t n, double s) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> coordinate(-40, 40);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < n; ++i)
    points.push_back({coordinate(random), coordinate(random), coordinate(random)});
  return PointGroups::single(points, s);
}

MatrixXd kernel(const ElasticBody& body, const WallRemainder& remainder, const PointGroups& a,
                const PointGroups& b) {
  return kelvin_between(a, b, body.poisson) - remainder.between(a, b).held;
}

TEST(WallRemainder, IsSymmetricAndLeavesAPositiveKernel) {
  const PointGroups points = random_points(60, 0.3);
  ElasticBody uneven = even_body();
  uneven.box_centre = {2, 1, -4};
  uneven.box_size = {110, 90, 100};
  for (const ElasticBody& body : {even_body(), uneven}) {
    const WallRemainder remainder(body);
    const Remainder::Parts parts = remainder.between(points, points);
    const MatrixXd G = kelvin_between(points, points, body.poisson);
    EXPECT_EQ(parts.held, MatrixXd(parts.held.transpose()));
    EXPECT_EQ(parts.motion.size(), 0);
    EXPECT_GT(test::symmetric_eigenvalues(parts.held)[0], -1e-12);
    EXPECT_GT(test::symmetric_eigenvalues(G - parts.held)[0], 1e-3 * G(0, 0));
  }
}

TEST(WallRemainder, OneObjectTwiceIsTheSameAsTwo) {
  const PointGroups points = random_points(20, 0.3), copy = points;
  const WallRemainder remainder(even_body());
  const MatrixXd once = remainder.between(points, points).held;
  EXPECT_LT((once - remainder.between(points, copy).held).norm(), 1e-13 * once.norm());
}

TEST(WallRemainder, FieldsAreColumnsTimesForces) {
  const PointGroups points = random_points(7, 0.3);
  const std::vector<Vec3> X = random_points(100, 0).points;
  const MatrixXd forces = MatrixXd::Random(21, 2);
  const WallRemainder remainder(even_body());
  const MatrixXd u = remainder.fields(X, points, forces).held;
  const MatrixXd K = remainder.between(PointGroups::single(X, 0), points).held;
  EXPECT_LT((u - K * forces).norm(), 1e-12 * u.norm());
}

TEST(WallRemainder, GroupsAreWeightedSumsOfTheirPoints) {
  const PointGroups points = random_points(4, 0.3);
  PointGroups groups = points;
  groups.first = {0, 3, 4};
  groups.weights = {0.5, 0.25, -0.5, 2};
  MatrixXd W = MatrixXd::Zero(6, 12);
  for (Index p = 0; p < 4; ++p)
    W.block<3, 3>(p < 3 ? 0 : 3, 3 * p) = groups.weights[static_cast<std::size_t>(p)] * Mat3::Identity();
  const WallRemainder remainder(even_body());
  const MatrixXd folded = remainder.between(groups, groups).held,
                 raw = remainder.between(points, points).held;
  EXPECT_LT((folded - W * raw * W.transpose()).norm(), 1e-13 * raw.norm());
}

// At the points of the walls, averaged over their cores, the kernel is zero.
TEST(WallRemainder, TheWallsPointsDoNotMove) {
  const PointGroups points = random_points(5, 0.3);
  const double cell = 96.0 / WallRemainder::kCells, core = WallRemainder::kCore * cell;
  const PointGroups wall =
      PointGroups::single(std::vector<Vec3>{{48, 0, cell}, {cell, 48, 2 * cell}}, core * core / 2);
  const ElasticBody body = even_body();
  EXPECT_LT(kernel(body, WallRemainder(body), wall, points).norm(), 1e-12);
}

TEST(WallRemainder, TheFieldNearlyVanishesAllOverTheWalls) {
  const ElasticBody body = even_body();
  const WallRemainder remainder(body);
  const PointGroups centre = PointGroups::single(std::vector<Vec3>{{0, 0, 0}}, 0.3);
  for (const double y : {0.0, 9.0, 20.0, 33.0}) {
    const PointGroups at = PointGroups::single(std::vector<Vec3>{{48, y, 5}}, 0);
    const MatrixXd free = kelvin_between(at, centre, body.poisson);
    EXPECT_LT(kernel(body, remainder, at, centre).norm(), 0.05 * free.norm()) << y;
  }
}

}  // namespace
}  // namespace brachy
