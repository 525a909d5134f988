#include "core/solve/per_landmark_support.h"

#include <gtest/gtest.h>

#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/core/solve/reference_solve.h"

namespace brachy {
namespace {

// of the middle one, in spacings (core/DESIGN.md, section 2)
constexpr double kSingular = 11.660167858376596;

TEST(PerLandmarkSystem, TheSingularTripleIsReportedAtAnyScale) {
  for (const double h : {0.1, 1.0, 3.0}) {
    const std::vector<Vec3> p{{0, 0, 0}, {0, 0, h}, {0, 0, 2 * h}};
    PerLandmarkSystem system(Wendland31{});
    const FactorStatus status = system.factorize(p, std::vector<double>{4 * h, kSingular * h, 4 * h});
    EXPECT_EQ(status.kind, FactorStatus::kIllConditioned) << h;
    EXPECT_GT(status.condition, 1e14) << h;
    EXPECT_EQ(system.condition(), status.condition);
    EXPECT_EQ(system.displacement({0, 0, h}), Vec3::Zero());
  }
}

TEST(PerLandmarkSystem, SlightlyBesideTheSingularTripleItSolves) {
  for (const double h : {0.1, 1.0, 3.0})
    for (const double share : {0.97, 1.03}) {
      const std::vector<Vec3> p{{0, 0, 0}, {0, 0, h}, {0, 0, 2 * h}}, d{{1, 0, 0}, {0, -1, 2}, {0.5, 0.5, 0}};
      PerLandmarkSystem system(Wendland31{});
      ASSERT_TRUE(system.factorize(p, std::vector<double>{4 * h, share * kSingular * h, 4 * h}));
      EXPECT_GT(system.condition(), 30);
      std::vector<Vec3> weights(3);
      system.solve(d, weights);
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_LT((system.displacement(p[i]) - d[i]).norm(), 1e-12) << h << " " << share;
    }
}

TEST(PerLandmarkSystem, TheConditionNumberGrowsTowardsTheSingularTriple) {
  double last = 0;
  for (const double off : {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}) {
    PerLandmarkSystem system(Wendland31{});
    EXPECT_TRUE(system.factorize(std::vector<Vec3>{{0, 0, 0}, {0, 0, 1}, {0, 0, 2}},
                                 std::vector<double>{4, kSingular * (1 + off), 4}));
    EXPECT_GT(system.condition(), 50 * last);
    last = system.condition();
  }
}

TEST(PerLandmarkSystem, WithOneSupportForAllItIsTheCommonSystem) {
  std::mt19937_64 random(1);
  const auto L = test::random_landmarks(random, 30, 15, 3, 2);
  for_each_kernel([&](auto kernel) {
    PerLandmarkSystem system(kernel);
    ASSERT_TRUE(system.factorize(L.positions, std::vector<double>(30, 12)));
    std::vector<Vec3> weights(30);
    system.solve(L.displacements, weights);
    RbfSystem common(kernel, 12, 30);
    ASSERT_TRUE(common.factorize(L.positions));
    const std::vector<Vec3> expected = test::solve(common, L.displacements);
    EXPECT_LT(test::relative_difference(weights, expected), 1e-11);
    EXPECT_LE(common.condition(), system.condition() * (1 + 1e-9));
    const RbfField field{kernel, 12, L.positions, expected};
    for (int i = 0; i < 20; ++i) {
      const Vec3 X = test::uniform_point(random, 20);
      EXPECT_LT((system.displacement(X) - field.displacement(X)).norm(), 1e-10);
      EXPECT_LT((system.deformation_gradient(X) - field.deformation_gradient(X)).norm(), 1e-10);
    }
  });
}

TEST(PerLandmarkSystem, ReproducesDisplacementsWithSupportsOfTheirOwnAndKnowsItsGradient) {
  std::mt19937_64 random(2);
  const auto L = test::random_landmarks(random, 30, 15, 4, 2);
  std::vector<double> supports;
  for (int i = 0; i < 30; ++i) supports.push_back(test::uniform(random, 4, 9));
  PerLandmarkSystem system(Wendland32{});
  ASSERT_TRUE(system.factorize(L.positions, supports));
  std::vector<Vec3> weights(30);
  system.solve(L.displacements, weights);
  for (std::size_t i = 0; i < 30; ++i)
    EXPECT_LT((system.displacement(L.positions[i]) - L.displacements[i]).norm(), 1e-10);
  const double h = 1e-5;
  for (int i = 0; i < 20; ++i) {
    const Vec3 X = test::uniform_point(random, 15);
    Mat3 numeric = Mat3::Identity();
    for (int k = 0; k < 3; ++k)
      numeric.col(k) +=
          (system.displacement(X + h * Vec3::Unit(k)) - system.displacement(X - h * Vec3::Unit(k))) / (2 * h);
    EXPECT_LT((system.deformation_gradient(X) - numeric).norm(), 1e-6 * (1 + numeric.norm()));
  }
}

TEST(PerLandmarkSystem, ReportsWhatCannotBeSolved) {
  PerLandmarkSystem system(Wendland31{});
  EXPECT_TRUE(system.factorize({}, {}));
  EXPECT_EQ(system.condition(), 1);
  const std::vector<Vec3> twice{{0, 0, 0}, {0, 0, 5}, {0, 0, 0}};
  EXPECT_EQ(system.factorize(twice, std::vector<double>{6, 8, 6}).kind, FactorStatus::kIllConditioned);
  EXPECT_EQ(system.condition(), INFINITY);
  const FactorStatus status =
      system.factorize(std::vector<Vec3>{{0, 0, 0}, {0, NAN, 5}}, std::vector<double>{6, 8});
  EXPECT_EQ(status.kind, FactorStatus::kNotFinite);
  EXPECT_EQ(status.first, 1);
}

}  // namespace
}  // namespace brachy
