#include "core/elasticity/fem/fem_remainder.h"

#include <memory>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "core/elasticity/elastic_kernel.h"
#include "core/elasticity/kelvin.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "tests/core/elasticity/symmetric_eigenvalues.h"

namespace brachy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

ElasticBody stiff_gland() {
  ElasticBody body;
  body.regions.push_back(
      std::make_shared<EllipsoidRegion>(Vec3::Zero(), Vec3(24, 18, 21), 3 * body.shear_modulus));
  body.needle_radius = 2;
  return body;
}

std::vector<Vec3> shaft() {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i) points.emplace_back(3, -1, 4.0 - 4 * i);
  return points;
}

class HexStiffness : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Poisson, HexStiffness, testing::Values(0.0, 0.3, 0.49, 0.4995));

// Pulled along x with free sides: Young's modulus 2(1 + ν) times the area, a quarter on each node.
TEST_P(HexStiffness, CarriesUniaxialTensionExactly) {
  const double nu = GetParam();
  const Vec3 size(2, 3, 5);
  std::array<double, 8> ones;
  ones.fill(1);
  const auto K = hex_stiffness(size, nu, ones);
  Eigen::Matrix<double, 24, 1> u, expected = Eigen::Matrix<double, 24, 1>::Zero();
  for (int a = 0; a < 8; ++a) {
    u.segment<3>(3 * a) << (a & 1) * size[0], -nu * (a >> 1 & 1) * size[1], -nu * (a >> 2) * size[2];
    expected[3 * a] = (a & 1 ? 1 : -1) * 2 * (1 + nu) * size[1] * size[2] / 4;
  }
  EXPECT_LT((K * u - expected).norm(), 1e-10 * K.norm());
  EXPECT_LT((K - K.transpose()).norm(), 1e-14 * K.norm());
}

// Walls moved as a linear field move every node inside by it, whatever the cells' sizes.
TEST_P(HexStiffness, ReproducesConstantStrainInAPatch) {
  Mat3 strain[3];
  strain[0] << 1, 0, 0, 0, -0.5, 0, 0, 0, 2;
  strain[1] << 0, 1, 0.3, 1, 0, 0, 0.3, 0, 0.1;
  strain[2] << 0, -1, 0, 1, 0, 0, 0, 0, 0;  // a rotation
  const auto motion = [&](const Vec3& X, const PointGroups&, std::size_t) {
    Mat3 u;
    for (int i = 0; i < 3; ++i) u.col(i) = strain[i] * X;
    return u;
  };
  const auto modulus = [](const HexMesh&, const HexMesh::Place&) {
    return std::array<double, 8>{1, 1, 1, 1, 1, 1, 1, 1};
  };
  const auto on_wall = [](const HexMesh& mesh, const HexMesh::Place& p) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (p[axis] == 0 || p[axis] == mesh.planes(axis) - 1) return true;
    return false;
  };
  const MeshSystem system(HexMesh({{{0, 1, 1.5, 4}, {0, 2, 3, 3.7, 9}, {-1, 1, 2}}}), GetParam(), modulus,
                          on_wall, SimdTarget::kGeneric);
  PointGroups none;  // a force without weight
  none.begin_group();
  none.add(Vec3(1, 2, 1), 0, 0);
  none.finish();
  const std::vector<Vec3> nodes = {{1, 2, 1}, {1.5, 3, 1}, {1.5, 3.7, 1}};
  const MatrixXd u = system.between(PointGroups::single(nodes, 0), none, motion);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    EXPECT_LT((u.middleRows<3>(static_cast<Index>(3 * i)) - motion(nodes[i], none, 0)).norm(), 1e-9);
}

TEST(BandFactor, SolvesAsADenseFactorDoesOnEveryTarget) {
  const int n = 150, band = 37;
  MatrixXd A = MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = std::max(0, i - band); j <= i; ++j)
      A(i, j) = A(j, i) = i == j ? 20 : std::sin(7.0 * i + 3 * j);
  const MatrixXd b = MatrixXd::Random(n, BandRow::kCount);
  for (const SimdTarget target :
       {SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2, SimdTarget::kAvx512}) {
    if (!is_supported(target)) continue;
    BandFactor factor(n, band, target);
    for (int i = 0; i < n; ++i)
      for (int j = std::max(0, i - band); j <= i; ++j) factor.at(i, j) = A(i, j);
    ASSERT_TRUE(factor.factor());
    const int zero_before = 61, from = 21;
    MatrixXd rest = b;
    rest.topRows(zero_before).setZero();
    // Two sets, of which the second is twice the first.
    const std::size_t second = factor.padded_rows();
    std::vector<BandRow> x(2 * second);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < BandRow::kCount; ++c) {
        x[static_cast<std::size_t>(i)].column[c] = rest(i, c);
        x[second + static_cast<std::size_t>(i)].column[c] = 2 * rest(i, c);
      }
    factor.solve(x.data(), 2, zero_before, from);
    const MatrixXd expected = A.llt().solve(rest);
    for (int i = from; i < n; ++i)
      for (int c = 0; c < BandRow::kCount; ++c) {
        ASSERT_NEAR(x[static_cast<std::size_t>(i)].column[c], expected(i, c), 1e-12);
        ASSERT_NEAR(x[second + static_cast<std::size_t>(i)].column[c], 2 * expected(i, c), 2e-12);
      }
  }
  BandFactor indefinite(2, 1, SimdTarget::kGeneric);
  indefinite.at(0, 0) = indefinite.at(1, 1) = 1;
  indefinite.at(1, 0) = 2;
  EXPECT_FALSE(indefinite.factor());
}

TEST(HexMesh, FillsTheBoxAndGrowsTowardsItsWalls) {
  const ElasticBody body = stiff_gland();
  const MeshPlanes planes = mesh_planes(body, {});
  for (const std::vector<double>& p : planes) {
    EXPECT_EQ(p.front(), -48);
    EXPECT_EQ(p.back(), 48);
    for (std::size_t i = 1; i < p.size(); ++i) EXPECT_GT(p[i], p[i - 1] + 1.5);
    EXPECT_GT(p[1] - p[0], 1.3 * (p[p.size() / 2] - p[p.size() / 2 - 1]));
  }
  const HexMesh mesh(planes);
  Vec3 sum = Vec3::Zero();
  const Vec3 X(-31.2, 7.7, 44.9);
  const HexMesh::Shape shape = mesh.shape(X);
  for (std::size_t a = 0; a < 8; ++a) sum += shape.share[a] * mesh.position(mesh.place(shape.node[a]));
  EXPECT_LT((sum - X).norm(), 1e-12);
}

TEST(FemRemainder, MakesASymmetricPositiveDefiniteKernel) {
  const ElasticBody body = stiff_gland();
  const ElasticKernel kernel(body, std::make_unique<FemRemainder>(body));
  const PointGroups groups = kernel.groups(shaft(), {});
  const MatrixXd C = kernel.between(groups, groups);
  EXPECT_LT((C - C.transpose()).norm(), 1e-3 * C.norm());
  const Eigen::VectorXd eigenvalues = test::symmetric_eigenvalues(0.5 * (C + C.transpose()));
  EXPECT_GT(eigenvalues.minCoeff(), 1e-3 * eigenvalues.maxCoeff());
}

// The part that the mesh cannot resolve is positive: no force does negative work there.
TEST(FemRemainder, LeavesAPositiveRestOfKelvin) {
  const ElasticBody body = stiff_gland();
  const FemRemainder remainder(body);
  std::vector<Vec3> points;
  for (int i = 0; i < 40; ++i)
    points.emplace_back(14 * std::sin(5.0 * i), 14 * std::sin(3.0 * i + 1), 40 * std::sin(2.3 * i));
  for (const double core : {0.5, 1.0, 2.5}) {
    const PointGroups groups = PointGroups::single(points, 0.5 * core * core);
    MatrixXd G(120, 120);
    for (std::size_t i = 0; i < 40; ++i)
      for (std::size_t j = 0; j < 40; ++j)
        G.block<3, 3>(static_cast<Index>(3 * i), static_cast<Index>(3 * j)) =
            kelvin(points[i] - points[j], core * core, body.poisson);
    MatrixXd rest = G - remainder.between(groups, groups).held;
    rest = 0.5 * (rest + rest.transpose()).eval();
    EXPECT_GT(test::symmetric_eigenvalues(rest)[0], -0.02 * G.diagonal().maxCoeff()) << core;
  }
}

TEST(FemRemainder, HoldsTheHeldFacesAndNotTheFreeOnes) {
  ElasticBody body = stiff_gland();
  body.held[4] = false;
  const FemRemainder remainder(body);
  const std::vector<Vec3> walls = {{-48, 3, 5}, {48, 0, -20}, {7, -48, 1}, {2, 48, 2}, {1, 2, 48}},
                          free = {{1, 2, -48}};
  const PointGroups force = PointGroups::single(shaft(), 0.1);
  EXPECT_EQ(remainder.between(PointGroups::single(walls, 0), force).motion.norm(), 0);
  EXPECT_GT(remainder.between(PointGroups::single(free, 0), force).motion.norm(), 1e-3);
}

// Walls at R take back about 2.1 r/R of it (a point force in a sphere at ν = ½: 9/4 · 1/(6πR) of 1/(8πr)).
TEST(FemRemainder, LeavesKelvinFarFromTheWalls) {
  ElasticBody body;
  body.box_size = Vec3::Constant(960);
  body.shear_modulus = 1;
  const ElasticKernel kernel(body, std::make_unique<FemRemainder>(body));
  const std::vector<Vec3> source = {Vec3(5, -11, 21)};
  for (const Vec3& x : {Vec3(1, 2, 2), Vec3(12, 3, -4), Vec3(20, 20, 30)}) {
    const std::vector<Vec3> X = {source[0] + x};
    const MatrixXd C = kernel.between(PointGroups::single(X, 0), PointGroups::single(source, 0.5));
    const Mat3 G = kelvin(x, 0.5, body.poisson);
    EXPECT_LT((C - G).norm(), 2.2 * x.norm() / 480 * G.norm() + 0.01 * G.norm());
    EXPECT_LT(C.trace(), G.trace());
  }
}

TEST(FemRemainder, FieldsAreRowsOfBetween) {
  const ElasticBody body = stiff_gland();
  const FemRemainder remainder(body);
  const ElasticKernel rings(body, nullptr);
  const PointGroups b = rings.groups(shaft(), {});
  std::vector<Vec3> X;
  for (int i = 0; i < 30; ++i)
    X.emplace_back(40 * std::sin(5.0 * i), 40 * std::sin(3.0 * i + 1), 60 * std::sin(2.3 * i));
  const auto rows = static_cast<Index>(3 * b.size());
  const Remainder::Parts all = remainder.between(PointGroups::single(X, 0), b),
                         some = remainder.fields(X, b, MatrixXd::Identity(rows, rows));
  EXPECT_LT((all.held - some.held).norm(), 1e-12 * all.held.norm());
  EXPECT_LT((all.motion - some.motion).norm(), 1e-12 * all.motion.norm());
}

TEST(FemRemainder, EmptyGroupsAreColumnsOfZeros) {
  const FemRemainder remainder(stiff_gland());
  PointGroups groups;
  groups.begin_group();
  groups.begin_group();
  groups.add(Vec3(1, 2, 3), 0, 1);
  groups.finish();
  const Remainder::Parts parts = remainder.between(groups, groups);
  EXPECT_EQ(parts.motion.leftCols(3).norm() + parts.held.leftCols(3).norm() + parts.held.topRows(3).norm(),
            0);
  EXPECT_GT(parts.motion(5, 5), 0);
}

}  // namespace
}  // namespace brachy
