#include "core/elasticity/compact/compact_kernel.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "tests/core/elasticity/symmetric_eigenvalues.h"
#include "tests/reference_files.h"
#include "tests/timed.h"

namespace brachy {
namespace {

ElasticBody body_of(double poisson) {
  ElasticBody body;
  body.poisson = poisson;
  body.needle_radius = 2;
  return body;
}

std::vector<Vec3> random_points(std::size_t n, const Vec3& half, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vec3> points(n);
  for (Vec3& p : points) {
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    p = half.cwiseProduct(Vec3(x, y, z));
  }
  return points;
}

double least_over_largest_eigenvalue(const MatrixKernel& kernel, const std::vector<Vec3>& points) {
  const PointGroups groups = kernel.groups(points, {});
  const Eigen::MatrixXd K = kernel.between(groups, groups);
  EXPECT_LT((K - K.transpose()).norm(), 1e-12 * K.norm());
  const Eigen::VectorXd eigenvalues = test::symmetric_eigenvalues(K);
  return eigenvalues.minCoeff() / eigenvalues.maxCoeff();
}

TEST(CompactKernel, PhiIsDivergenceFreeAndUnitAtTheOrigin) {
  const CompactKernel phi({{12, 0, 1}}, 1);
  EXPECT_EQ(phi.value(Vec3::Zero()), Mat3(Mat3::Identity()));
  const double h = 1e-4;
  for (const Vec3& x : random_points(200, Vec3::Constant(7), 1)) {
    Vec3 divergence = Vec3::Zero();
    for (int k = 0; k < 3; ++k)
      divergence += (phi.value(x + h * Vec3::Unit(k)) - phi.value(x - h * Vec3::Unit(k))).row(k) / (2 * h);
    EXPECT_LT(divergence.norm(), 1e-8) << x.transpose();
  }
}

TEST(CompactKernel, IsPositiveDefiniteOnRandomAndNearlyCoplanarPoints) {
  const CompactKernel kernel = CompactKernel::of_body(body_of(0.49));
  EXPECT_GT(least_over_largest_eigenvalue(kernel, random_points(60, Vec3::Constant(20), 2)), 1e-6);
  EXPECT_GT(least_over_largest_eigenvalue(kernel, random_points(60, {20, 20, 1e-9}, 3)), 1e-6);
  EXPECT_GT(least_over_largest_eigenvalue(kernel, random_points(20, {20, 1e-9, 1e-9}, 4)), 1e-9);
  const CompactKernel phi({{30, 0, 1}}, 1);
  EXPECT_GT(least_over_largest_eigenvalue(phi, random_points(60, Vec3::Constant(20), 5)), 1e-6);
}

TEST(CompactKernel, IsExactlyZeroFromItsSupportOn) {
  const CompactKernel kernel = CompactKernel::of_body(body_of(0.49));
  EXPECT_EQ(kernel.support(), 48);
  EXPECT_EQ(kernel.value(Vec3(0, 48, 0)), Mat3(Mat3::Zero()));
  EXPECT_EQ(kernel.value(Vec3(40, 30, -20)), Mat3(Mat3::Zero()));
  EXPECT_NE(kernel.value(Vec3(0, 0, 47)), Mat3(Mat3::Zero()));
  MatrixKernelSystem system(kernel);
  const std::vector<Vec3> landmark = {Vec3(0, 0, 0)}, d = {Vec3(1, 2, 3)};
  ASSERT_TRUE(system.factorize(landmark));
  EXPECT_EQ(system.evaluate(std::vector<Vec3>{{0, -48, 0}}, system.solve(d))[0], Vec3(0, 0, 0));
}

TEST(CompactKernel, GradientIsThatOfTheValue) {
  const CompactKernel kernel({{6, 1.5, 0.3}, {12, 0.4, 2}}, 0.7);
  const Vec3 f(0.3, -1, 2);
  const double h = 1e-5;
  for (const Vec3& x : random_points(200, Vec3::Constant(8), 4)) {
    Mat3 differences;
    for (int k = 0; k < 3; ++k)
      differences.col(k) =
          (kernel.value(x + h * Vec3::Unit(k)) - kernel.value(x - h * Vec3::Unit(k))) * f / (2 * h);
    EXPECT_LT((kernel.gradient(x, f) - differences).norm(), 1e-8) << x.transpose();
  }
  EXPECT_EQ(kernel.gradient(Vec3::Zero(), f), Mat3(Mat3::Zero()));
  EXPECT_EQ(kernel.gradient({12, 0, 0}, f), Mat3(Mat3::Zero()));
}

TEST(CompactKernel, EndsAtTheNearestWall) {
  ElasticBody body = body_of(0.49);
  body.box_size = Vec3(120, 60, 90);
  EXPECT_EQ(CompactKernel::of_body(body).support(), 30);
}

TEST(CompactKernel, ReproducesLandmarksAndScalesForcesByTheModulus) {
  const std::vector<Vec3> landmarks = random_points(40, Vec3::Constant(20), 6),
                          d = random_points(40, Vec3::Constant(2), 7);
  ElasticBody body = body_of(0.49);
  const CompactKernel kernel = CompactKernel::of_body(body);
  body.shear_modulus *= 3;
  const CompactKernel stiffer = CompactKernel::of_body(body);
  MatrixKernelSystem system(kernel), stiffer_system(stiffer);
  ASSERT_TRUE(system.factorize(landmarks));
  ASSERT_TRUE(stiffer_system.factorize(landmarks));
  const std::vector<Vec3> forces = system.solve(d), stiffer_forces = stiffer_system.solve(d);
  const std::vector<Vec3> u = system.evaluate(landmarks, forces);
  for (std::size_t i = 0; i < d.size(); ++i) {
    EXPECT_LT((u[i] - d[i]).norm(), 1e-11);
    EXPECT_LT((stiffer_forces[i] - 3 * forces[i]).norm(), 1e-9 * forces[i].norm());
  }
}

TEST(CompactKernel, RefusesDuplicatesByName) {
  const CompactKernel kernel = CompactKernel::of_body(body_of(0.49));
  MatrixKernelSystem system(kernel);
  const FactorStatus status = system.factorize(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}});
  EXPECT_EQ(status.kind, FactorStatus::kDuplicate);
  EXPECT_EQ(status.first, 0);
  EXPECT_EQ(status.second, 2);
}

TEST(CompactFit, NonNegativeLeastSquaresMeetsItsConditions) {
  // Free minimum (3, −1): the second is held at 0 and the first moves to its own minimum along the edge, 5/2.
  Eigen::MatrixXd A(2, 2);
  A << 1, 1, 1, 0;
  Eigen::VectorXd x = nonnegative_least_squares(A, Eigen::Vector2d(2, 3));
  EXPECT_NEAR(x[0], 2.5, 1e-14);
  EXPECT_EQ(x[1], 0);
  // All held at 0: b points away from every column.
  EXPECT_EQ(nonnegative_least_squares(A, Eigen::Vector2d(-1, -1)), Eigen::VectorXd(Eigen::Vector2d::Zero()));

  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  int active = 0, passive = 0;
  for (int trial = 0; trial < 50; ++trial) {
    A = Eigen::MatrixXd::NullaryExpr(30, 12, [&] { return normal(random); });
    const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(30, [&] { return normal(random); });
    x = nonnegative_least_squares(A, b);
    const Eigen::VectorXd gradient = A.transpose() * (A * x - b);
    for (Eigen::Index j = 0; j < x.size(); ++j) {
      EXPECT_GE(x[j], 0);
      EXPECT_GT(gradient[j], -1e-10);
      EXPECT_LT(std::abs(x[j] * gradient[j]), 1e-10);
      ++(x[j] > 0 ? passive : active);
    }
  }
  EXPECT_GT(active, 100);
  EXPECT_GT(passive, 100);
}

TEST(CompactFit, FindsTheStudysWeights) {
  const auto expect_near = [](const std::vector<double>& found, const std::vector<double>& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(found[k], expected[k], 0.5001e-4) << k;
  };
  const auto column = [](const CompactFit& fit, double CompactTerm::*member) {
    std::vector<double> values;
    for (const CompactTerm& t : fit.terms) values.push_back(t.*member);
    return values;
  };
  const CompactFit elastic = fit_compact(0.49, 2.5, 48);
  expect_near(column(elastic, &CompactTerm::support), {3, 6, 12, 24, 48});
  expect_near(column(elastic, &CompactTerm::w), {0, 0, 0, 0, .0580});
  expect_near(column(elastic, &CompactTerm::v), {0, .0691, .1512, .0714, .0431});
  EXPECT_NEAR(elastic.residual, 0.179, 0.0005);
}

TEST(CompactFit, IsDoneBeforeAStartUpNotices) {
  const test::MostProcessorTime limit(0.01);
  fit_compact(0.49, 2.5, 48);
}

// Relative L2 error over field.csv, %.
double error_of(const std::string& scene, double poisson) {
  const test::ReferenceVectors landmarks = test::load_vectors(test::kReferences / scene / "landmarks.csv"),
                               field = test::load_vectors(test::kReferences / scene / "field.csv");
  const CompactKernel kernel = CompactKernel::of_body(body_of(poisson));
  MatrixKernelSystem system(kernel);
  EXPECT_TRUE(system.factorize(landmarks.positions));
  const std::vector<Vec3> u = system.evaluate(field.positions, system.solve(landmarks.displacements));
  double off = 0, all = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    off += (u[i] - field.displacements[i]).squaredNorm();
    all += field.displacements[i].squaredNorm();
  }
  return 100 * std::sqrt(off / all);
}

TEST(CompactKernel, ErrsOnTheReferenceScenesAsTheStudySays) {
  const struct {
    const char* scene;
    double poisson, compact_elastic;  // %: MODEL_STUDY.md, the rows "supports to the wall"
  } rows[] = {
      {"push_homogeneous", 0.49, 31.9},
      {"straight_homogeneous", 0.49, 23.0},
      {"oblique_homogeneous", 0.45, 11.2},
      {"lateral_homogeneous", 0.49, 36.2},
      {"push_stiff", 0.49, 34.6},
      {"straight_stiff", 0.45, 35.8},
      {"oblique_stiff", 0.49, 28.0},
      {"lateral_stiff", 0.49, 31.2},
      {"free_face_homogeneous", 0.49, 15.2},
      {"free_face_stiff_lateral", 0.49, 32.4},
  };
  for (const auto& row : rows) {
    EXPECT_NEAR(error_of(row.scene, row.poisson), row.compact_elastic, 0.0501) << row.scene;
  }
}

}  // namespace
}  // namespace brachy
