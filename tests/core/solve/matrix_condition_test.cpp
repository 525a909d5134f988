#include "core/solve/matrix_condition.h"

#include <gtest/gtest.h>

#include <random>

#include <Eigen/LU>

#include "core/elasticity/compact/compact_kernel.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/scene/load_tissue.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

using test::uniform_point;

double exact_matrix_condition(const Eigen::MatrixXd& K) {
  const auto norm = [](const auto& m) {
    return static_cast<double>(m.cwiseAbs().colwise().sum().maxCoeff());
  };
  using Exact = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  return norm(K) * norm(Exact(K.cast<long double>().inverse()));
}

ElasticBody body() {
  ElasticBody body;
  body.needle_radius = 2;
  return body;
}

// Clouds, and clouds in which some are close to one of the others.
std::vector<Vec3> random_points(std::mt19937_64& random, bool crowded) {
  const auto n = 1 + random() % 12;
  std::vector<Vec3> p;
  for (std::size_t i = 0; i < n; ++i) p.push_back(uniform_point(random, 20));
  if (crowded)
    for (int i = 0; i < 2; ++i)
      p.push_back(p[0] + uniform_point(random, std::pow(10, test::uniform(random, -4, 0))));
  return p;
}

void expect_matrix_estimate(double estimate, const Eigen::MatrixXd& K) {
  const double exact = exact_matrix_condition(K);
  EXPECT_LE(estimate, exact * (1 + 1e-15 * static_cast<double>(K.rows()) * (1 + exact)));
  EXPECT_GE(estimate, exact / 3);
}

TEST(MatrixCondition, IsEstimatedWithinAThirdOfTheTruthAndNeverAboveIt) {
  std::mt19937_64 random(1);
  int near_singular = 0;
  const CompactKernel kernel = CompactKernel::of_body(body());
  for (int trial = 0; trial < 120; ++trial) {
    MatrixKernelSystem system(kernel);
    if (!system.factorize(random_points(random, trial % 2))) {
      EXPECT_GT(system.condition(), FactorStatus::kMaxCondition);
      continue;
    }
    SCOPED_TRACE(trial);
    expect_matrix_estimate(system.condition(), system.matrix());
    near_singular += system.condition() > 1e6;
  }
  EXPECT_GT(near_singular, 20);
}

TEST(MatrixCondition, ReadsTheLowerTriangleOnly) {
  Eigen::MatrixXd K(3, 3);
  K << 4, NAN, NAN, -2, 5, NAN, 1, 0.5, 3;
  Eigen::VectorXd sums(3);
  EXPECT_EQ(symmetric_norm(K, sums), 7.5);
}

TEST(MatrixCondition, OfATickIsThatOfTheExactSystem) {
  const Tissue tissue = load_tissue(Scene{}).tissue;
  std::vector<Vec3> p;
  for (int k = 0; k <= 6; ++k) p.push_back(Vec3(3, -2, -19) + 5.0 * k * Vec3(0.1, 0, 0.99));
  for (const char* model_name : {"compact_elastic", "elastic"}) {
    MatrixKernelField field(tissue, model_name, body(), {});
    EXPECT_EQ(field.condition(), 1);
    ASSERT_TRUE(field.update(LandmarkSet::of(p, std::vector<Vec3>(7, Vec3(0, 0, 1)))));
    MatrixKernelSystem system(field.kernel());
    ASSERT_TRUE(system.factorize(p));
    EXPECT_NEAR(field.condition(), system.condition(), 0.05 * system.condition()) << model_name;
    // A tip that almost coincides with the last landmark.
    std::vector<Vec3> near = p;
    near.push_back(near.back() + Vec3(0, 0, 1e-7));
    EXPECT_EQ(field.update(LandmarkSet::of(near, std::vector<Vec3>(8, Vec3(0, 0, 1)))).kind,
              FactorStatus::kDuplicate)
        << model_name;
    ASSERT_TRUE(field.update(LandmarkSet::of({})));
    EXPECT_EQ(field.condition(), 1);
  }
}

TEST(MatrixCondition, AboveTheBoundIsRefusedWithTheNumber) {
  const CompactKernel kernel = CompactKernel::of_body(body());
  MatrixKernelSystem system(kernel);
  std::vector<Vec3> p;
  for (int i = 0; i < 2; ++i) p.emplace_back(0, 0, 3e-6 * i);
  const FactorStatus status = system.factorize(p);
  EXPECT_EQ(status.kind, FactorStatus::kIllConditioned);
  EXPECT_GT(status.condition, FactorStatus::kMaxCondition);
  EXPECT_EQ(system.size(), 0u);
}

}  // namespace
}  // namespace brachy
