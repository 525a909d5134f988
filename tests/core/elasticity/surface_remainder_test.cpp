#include "core/elasticity/surface_remainder.h"

#include <gtest/gtest.h>

#include <random>

#include <Eigen/Cholesky>

#include "core/base/error.h"
#include "core/elasticity/kelvin_sums.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/elasticity/symmetric_eigenvalues.h"

namespace brachy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// The stored scenes' body: a cube of 96 mm with a gland k times as stiff.
ElasticBody body_with_gland(double k, double poisson = 0.45) {
  ElasticBody body;
  body.poisson = poisson;
  body.shear_modulus = 2e-3;
  body.regions = {std::make_shared<EllipsoidRegion>(Vec3::Zero(), Vec3(24, 18, 21), 2e-3 * k)};
  return body;
}

ElasticBody free_perineum(double k) {
  ElasticBody body = body_with_gland(k, 0.49);
  body.held[4] = false;
  return body;
}

const SurfaceRemainderOptions kCoarse = {.capsule_points = 80};  // for what does not depend on the number

double modulus_at(const ElasticBody& body, const Vec3& X) {
  std::vector<double> shares(body.regions.size() + 1);
  body.material_shares(X, shares);
  double k = 0;
  for (std::size_t m = 0; m < shares.size(); ++m) k += shares[m] * body.materials()[m];
  return k;
}

// C = w (G − Q) + P between groups of one point each.
MatrixXd kernel(const ElasticBody& body, const SurfaceRemainder& remainder, const PointGroups& a,
                const PointGroups& b) {
  MatrixXd C = kelvin_between(a, b, body.poisson);
  const Remainder::Parts parts = remainder.between(a, b);
  C -= parts.held;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      C.block<3, 3>(static_cast<Index>(3 * i), static_cast<Index>(3 * j)) *=
          2 / (modulus_at(body, a.points[i]) + modulus_at(body, b.points[j]));
  if (parts.motion.size() > 0) C += parts.motion;
  return C;
}

PointGroups random_points(std::size_t n, double s) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> coordinate(-40, 40);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < n; ++i)
    points.push_back({coordinate(random), coordinate(random), coordinate(random)});
  return PointGroups::single(points, s);
}

double least_eigenvalue(const MatrixXd& K) {
  return test::symmetric_eigenvalues(K)[0];
}

// The constants are what scripts/reference/study_oracle.py printed: C g for g = (1, 2, …, 12), and u at three points.
void expect_python(const ElasticBody& body, const std::array<double, 12>& forced,
                   const std::array<double, 9>& moved) {
  PointGroups points;
  const std::array<Vec3, 4> at = {Vec3(1, 2, 3), Vec3(-4, 5, -6), Vec3(3, -2, -38), Vec3(25, 20, 10)};
  const std::array<double, 4> cores = {1, 2, 0.5, 3};
  for (std::size_t i = 0; i < at.size(); ++i) {
    points.begin_group();
    points.add(at[i], cores[i], 1);
  }
  points.finish();
  const std::vector<Vec3> X = {{0, 0, 1}, {10, -8, 5}, {-15, 5, -10}};
  const SurfaceRemainder remainder(body);
  const MatrixXd C = kernel(body, remainder, points, points);
  const Eigen::VectorXd C_g = C * Eigen::VectorXd::LinSpaced(12, 1, 12);
  Eigen::VectorXd d(12);
  d << 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, -1, 0.5;
  const Eigen::VectorXd f = C.llt().solve(d);
  const Eigen::VectorXd u = kernel(body, remainder, PointGroups::single(X, 0), points) * f;
  for (Index i = 0; i < 12; ++i)
    EXPECT_NEAR(C_g[i], forced[static_cast<std::size_t>(i)], 1e-9 * C_g.lpNorm<Eigen::Infinity>());
  for (Index i = 0; i < 9; ++i)
    EXPECT_NEAR(u[i], moved[static_cast<std::size_t>(i)], 1e-9 * u.lpNorm<Eigen::Infinity>());
}

TEST(SurfaceRemainder, AgreesWithThePythonStudyInAStiffGland) {
  expect_python(
      body_with_gland(3),
      {0.0368647817020256, 0.0537039405782733, 0.0800772855966749, 0.0675262541096023, 0.0809176942518885,
       0.0997698061588568, 0.553273152631287, 0.640255593122772, 0.700498033493561, 0.308206744146381,
       0.339061726196506, 0.379429359250942},
      {0.252807385881905, 0.159433123137125, -0.00251930116340374, 0.0515975632376906, 0.0109653929233323,
       -0.0160775630482153, 0.0454618461959846, 0.123134752912271, 0.0249618167970274});
}

TEST(SurfaceRemainder, AgreesWithThePythonStudyUnderAFreeFace) {
  expect_python(
      free_perineum(3),
      {0.0332301486847116, 0.0496604375771444, 0.083059463398469, 0.0627771780280435, 0.0781006735848264,
       0.104421045395902, 0.563440119950973, 0.647612551577872, 0.747800659171536, 0.293895123356877,
       0.323188721446275, 0.364372488714823},
      {0.240354526845611, 0.165104628206981, 0.00221009648933755, 0.0417870155631363, 0.00415935782163776,
       -0.0132206522756212, 0.0384938801060249, 0.122833444949374, 0.0373390616713454});
}

TEST(SurfaceRemainder, PartsAreSymmetricAndLeaveAPositiveKernel) {
  const PointGroups points = random_points(60, 0.3);
  for (const double k : {0.3, 3.0, 8.0})
    for (const ElasticBody& body : {body_with_gland(k), free_perineum(k)}) {
      const SurfaceRemainder remainder(body, kCoarse);
      const Remainder::Parts parts = remainder.between(points, points);
      const MatrixXd G = kelvin_between(points, points, body.poisson);
      EXPECT_EQ(parts.held, MatrixXd(parts.held.transpose()));
      EXPECT_EQ(parts.motion, MatrixXd(parts.motion.transpose()));
      EXPECT_GT(least_eigenvalue(G - parts.held), 1e-3 * G(0, 0));
      EXPECT_GT(least_eigenvalue(parts.motion), -1e-12);
      EXPECT_GT(least_eigenvalue(kernel(body, remainder, points, points)), 1e-4 * G(0, 0));
    }
}

TEST(SurfaceRemainder, OneObjectTwiceIsTheSameAsTwo) {
  const PointGroups points = random_points(20, 0.3), copy = points;
  const SurfaceRemainder remainder(free_perineum(3), kCoarse);
  const Remainder::Parts once = remainder.between(points, points), twice = remainder.between(points, copy);
  EXPECT_LT((once.held - twice.held).norm(), 1e-13 * once.held.norm());
  EXPECT_LT((once.motion - twice.motion).norm(), 1e-13 * once.motion.norm());
}

TEST(SurfaceRemainder, FieldsAreColumnsTimesForces) {
  const PointGroups points = random_points(7, 0.3);
  const std::vector<Vec3> X = random_points(100, 0).points;
  const MatrixXd forces = MatrixXd::Random(21, 2);
  for (const ElasticBody& body :
       {body_with_gland(1), body_with_gland(3), free_perineum(1), free_perineum(3)}) {
    const SurfaceRemainder remainder(body, kCoarse);
    const Remainder::Parts u = remainder.fields(X, points, forces);
    const Remainder::Parts K = remainder.between(PointGroups::single(X, 0), points);
    EXPECT_LT((u.held - K.held * forces).norm(), 1e-12 * u.held.norm());
    ASSERT_EQ(u.motion.size() > 0, K.motion.size() > 0);
    if (u.motion.size() > 0) {
      EXPECT_LT((u.motion - K.motion * forces).norm(), 1e-12 * u.motion.norm());
    }
  }
}

TEST(SurfaceRemainder, GroupsAreWeightedSumsOfTheirPoints) {
  const PointGroups points = random_points(4, 0.3);
  PointGroups groups = points;
  groups.first = {0, 3, 4};
  groups.weights = {0.5, 0.25, -0.5, 2};
  MatrixXd W = MatrixXd::Zero(6, 12);
  for (Index p = 0; p < 4; ++p)
    W.block<3, 3>(p < 3 ? 0 : 3, 3 * p) = groups.weights[static_cast<std::size_t>(p)] * Mat3::Identity();
  const SurfaceRemainder remainder(body_with_gland(3), kCoarse);
  const Remainder::Parts folded = remainder.between(groups, groups), raw = remainder.between(points, points);
  EXPECT_LT((folded.held - W * raw.held * W.transpose()).norm(), 1e-13 * raw.held.norm());
  EXPECT_LT((folded.motion - W * raw.motion * W.transpose()).norm(), 1e-13 * raw.motion.norm());
}

// At the points of the walls, averaged over their cores, the kernel is zero in every case.
TEST(SurfaceRemainder, TheWallsPointsDoNotMove) {
  const PointGroups points = random_points(5, 0.3);
  const double cell = 96 / 5.0, core = 0.7 * cell;
  const PointGroups wall =
      PointGroups::single(std::vector<Vec3>{{48, 0, cell}, {cell, 48, 2 * cell}}, core * core / 2);
  for (const ElasticBody& body : {body_with_gland(1), body_with_gland(3), free_perineum(3)}) {
    const MatrixXd C = kernel(body, SurfaceRemainder(body, kCoarse), wall, points);
    EXPECT_LT(C.norm(), 1e-12);
  }
}

TEST(SurfaceRemainder, TheFieldNearlyVanishesAllOverTheWalls) {
  const ElasticBody body = body_with_gland(3);
  const SurfaceRemainder remainder(body, kCoarse);
  const PointGroups centre = PointGroups::single(std::vector<Vec3>{{0, 0, 0}}, 0.3);
  for (const double y : {0.0, 9.0, 20.0, 33.0}) {
    const PointGroups at = PointGroups::single(std::vector<Vec3>{{48, y, 5}}, 0);
    const MatrixXd free = kelvin_between(at, centre, body.poisson);
    EXPECT_LT(kernel(body, remainder, at, centre).norm(), 0.05 * free.norm()) << y;
  }
}

TEST(SurfaceRemainder, ARegionLikeTheRestIsNone) {
  const PointGroups points = random_points(8, 0.3);
  ElasticBody none = body_with_gland(1);
  none.regions.clear();
  const SurfaceRemainder equal(body_with_gland(1)), bare(none), nearly(body_with_gland(1 + 1e-7));
  EXPECT_EQ(equal.between(points, points).held, bare.between(points, points).held);
  EXPECT_EQ(equal.between(points, points).motion.size(), 0);
  EXPECT_EQ(equal.size(), 150u);
  EXPECT_EQ(nearly.size(), 350u);
  const MatrixXd C = kernel(none, bare, points, points);
  EXPECT_LT((kernel(body_with_gland(1 + 1e-7), nearly, points, points) - C).norm(), 1e-6 * C.norm());
}

TEST(SurfaceRemainder, AStiffGlandMovesLessAndASoftOneMore) {
  const PointGroups inside = PointGroups::single(std::vector<Vec3>{{2, 3, 1}, {-5, 0, 8}}, 0.3);
  MatrixXd last;
  for (const double k : {0.25, 1.0, 3.0, 9.0}) {
    const ElasticBody body = body_with_gland(k);
    const MatrixXd C = kernel(body, SurfaceRemainder(body, kCoarse), inside, inside);
    if (last.size() > 0) {
      EXPECT_GT(least_eigenvalue(last - C), 0) << k;
    }
    last = C;
  }
}

TEST(SurfaceRemainder, TakesAMeshOffCentreInABoxThatIsNoCube) {
  ElasticBody body;
  body.box_centre = {2, 1, -4};
  body.box_size = {110, 90, 100};
  body.held = {true, true, false, true, false, true};
  body.regions = {std::make_shared<MeshRegion>(prostate_phantom(), 6e-3)};
  const SurfaceRemainder remainder(body, kCoarse);
  const PointGroups points = random_points(40, 0.3);
  EXPECT_GT(least_eigenvalue(kernel(body, remainder, points, points)), 0);
}

TEST(SurfaceRemainder, RefusesTwoRegions) {
  ElasticBody body = body_with_gland(3);
  body.regions.push_back(body.regions[0]);
  try {
    SurfaceRemainder remainder(body, kCoarse);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("use kernel = \"fem\""), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace brachy
