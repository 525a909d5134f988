#include <gtest/gtest.h>

#include <cmath>

#include "core/solve/anchors.h"
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

using test::random_landmarks;
using test::uniform_point;

struct Solved {
  std::vector<Vec3> positions, weights;
  RbfField field;
};

Solved solve(Kernel kernel, double a, const std::vector<Vec3>& p, const std::vector<Vec3>& d) {
  RbfSystem system(kernel, a, static_cast<int>(p.size()));
  EXPECT_TRUE(system.factorize(p));
  Solved s{p, std::vector<Vec3>(p.size()), {kernel, a, {}, {}}};
  system.solve(d, s.weights);
  s.field.positions = s.positions;
  s.field.weights = s.weights;
  return s;
}

// Every kernel, with supports from a few neighbours to all.
template <class F>
void for_kernels_and_supports(F&& f) {
  for_each_kernel([&](auto kernel) {
    for (double a : {6.0, 12.0, 40.0}) f(Kernel(kernel), a);
  });
}

TEST(RbfSystem, ReproducesLandmarkDisplacements) {
  std::mt19937_64 random(1);
  for_kernels_and_supports([&](Kernel kernel, double a) {
    for (int n : {1, 4, 10, 30, 100}) {
      const auto L = random_landmarks(random, n, 20, 4, 5);
      const Solved s = solve(kernel, a, L.positions, L.displacements);
      for (int i = 0; i < n; ++i)
        EXPECT_LT((s.field.displacement(L.positions[i]) - L.displacements[i]).norm(),
                  1e-9 * L.displacements[i].norm())
            << name_of(kernel) << " a=" << a << " n=" << n;
    }
  });
}

TEST(RbfSystem, SolveCanBeRepeatedForOneFactorization) {
  const std::vector<Vec3> p{{0, 0, 0}, {5, 0, 0}};
  RbfSystem system(Wendland31{}, 12, 2);
  ASSERT_TRUE(system.factorize(p));
  std::vector<Vec3> w(2), w2(2);
  system.solve(std::vector<Vec3>{{1, 0, 0}, {0, 0, 0}}, w);
  system.solve(std::vector<Vec3>{{2, 0, 0}, {0, 0, 0}}, w2);
  EXPECT_LT((w2[0] - 2 * w[0]).norm() + (w2[1] - 2 * w[1]).norm(), 1e-15);
}

TEST(RbfSystem, DuplicatesAreRefusedByName) {
  RbfSystem system(Wendland31{}, 12, 3);
  const FactorStatus status = system.factorize(std::vector<Vec3>{{0, 0, 0}, {5, 0, 0}, {5, 0, 1e-6}});
  EXPECT_EQ(status.kind, FactorStatus::kDuplicate);
  EXPECT_EQ(status.first, 1);
  EXPECT_EQ(status.second, 2);
}

TEST(RbfSystem, LandmarksThatAreNotFiniteAreRefusedByName) {
  RbfSystem system(Wendland31{}, 12, 2);
  const FactorStatus status = system.factorize(std::vector<Vec3>{{0, 0, 0}, {5, NAN, 0}});
  EXPECT_EQ(status.kind, FactorStatus::kNotFinite);
  EXPECT_EQ(status.first, 1);
}

TEST(RbfSystem, LossOfDefinitenessIsReported) {
  // 20 landmarks 1e-3 mm apart under ψ3,2 at a = 40: λmin is about 161 (q/a)⁵ = 2e-20, below rounding.
  std::vector<Vec3> p;
  for (int i = 0; i < 20; ++i) p.push_back({i * 1e-3, 0, 0});
  RbfSystem system(Wendland32{}, 40, 20);
  EXPECT_EQ(system.factorize(p).kind, FactorStatus::kNotPositiveDefinite);
}

TEST(RbfField, IsExactlyZeroOutsideEverySupport) {
  const Solved s = solve(Buhmann{}, 6, {{0, 0, 0}, {3, 0, 0}}, {{1, 2, 3}, {3, 2, 1}});
  EXPECT_EQ(s.field.displacement({9, 0, 0}), Vec3::Zero());
  EXPECT_EQ(s.field.deformation_gradient({0, -6, 0}), Mat3::Identity());
}

TEST(RbfField, DeformationGradientIsTheDerivativeOfTheDisplacement) {
  std::mt19937_64 random(2);
  for_kernels_and_supports([&](Kernel kernel, double a) {
    const auto L = random_landmarks(random, 10, 10, 3, 2);
    const Solved s = solve(kernel, a, L.positions, L.displacements);
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3 X = uniform_point(random, 10);
      const double h = 1e-5;
      Mat3 numeric = Mat3::Identity();
      for (int k = 0; k < 3; ++k)
        numeric.col(k) +=
            (s.field.displacement(X + h * Vec3::Unit(k)) - s.field.displacement(X - h * Vec3::Unit(k))) /
            (2 * h);
      EXPECT_LT((s.field.deformation_gradient(X) - numeric).cwiseAbs().maxCoeff(),
                2e-7 * (1 + numeric.norm()))
          << name_of(kernel);
    }
  });
}

// det J = 1 + (|d|/a) ψ′(r) cosθ: at the steepest slope, straight ahead, it is 1 − M |d|/a (core/DESIGN.md,
// section 4).
TEST(RbfField, OneLandmarkFoldsAtSupportOverM) {
  for_each_kernel([](auto kernel) {
    const double a = 6;
    for (double share : {0.99, 1.01}) {
      const Solved s = solve(kernel, a, {{0, 0, 0}}, {{share * a / kernel.kMaxSlope, 0, 0}});
      double least = 1;
      for (int i = 1; i < 6000; ++i) least = std::min(least, s.field.jacobian({i * 1e-3, 0, 0}));
      EXPECT_EQ(least > 0, share < 1) << kernel.kName;
    }
  });
}

TEST(RbfField, TurnsWithTheScene) {
  std::mt19937_64 random(3);
  const auto L = random_landmarks(random, 12, 12, 3, 3);
  const RigidTransform X_AB{Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).toRotationMatrix(),
                            {100, -50, 30}};
  std::vector<Vec3> p, d;
  for (int i = 0; i < 12; ++i) {
    p.push_back(X_AB * L.positions[i]);
    d.push_back(X_AB.R * L.displacements[i]);
  }
  const Solved s = solve(Wendland32{}, 12, L.positions, L.displacements),
               turned = solve(Wendland32{}, 12, p, d);
  for (int trial = 0; trial < 50; ++trial) {
    const Vec3 X = uniform_point(random, 15);
    EXPECT_LT((turned.field.displacement(X_AB * X) - X_AB.R * s.field.displacement(X)).norm(), 1e-10);
  }
}

std::vector<Vec3> sphere_points() {
  std::mt19937_64 random(4);
  std::vector<Vec3> points;
  for (int i = 0; i < 200; ++i) points.push_back(Vec3(1, 2, 3) + 20 * uniform_point(random, 1).normalized());
  return points;
}

TEST(Anchors, AreSurfacePointsScaledAboutTheCentroid) {
  const auto surface = sphere_points();
  Vec3 centroid = Vec3::Zero();
  for (const Vec3& v : surface) centroid += v / 200;
  const Anchors anchors(surface, {.count = 8, .lambda_rest = 0.5, .lambda_loaded = 0.5});
  ASSERT_EQ(anchors.positions().size(), 8u);
  for (const Vec3& anchor : anchors.positions()) {
    double nearest = 1e9;
    for (const Vec3& v : surface)
      nearest = std::min(nearest, (centroid + 2 * (anchor - centroid) - v).norm());
    EXPECT_LT(nearest, 1e-12);
  }
}

TEST(Anchors, AreDistinctAndFollowTheSeed) {
  const auto surface = sphere_points();
  const Anchors all(surface, {.count = 200}), again(surface, {.count = 200}),
      other(surface, {.count = 200, .seed = 2});
  for (int i = 0; i < 200; ++i)
    for (int j = 0; j < i; ++j) ASSERT_GT((all.positions()[i] - all.positions()[j]).norm(), 0);
  EXPECT_TRUE(std::equal(all.positions().begin(), all.positions().end(), again.positions().begin()));
  EXPECT_FALSE(std::equal(all.positions().begin(), all.positions().end(), other.positions().begin()));
}

TEST(Anchors, RetreatUnderLoadAndReturnBitwise) {
  const auto surface = sphere_points();
  Anchors anchors(surface, {.count = 8, .lambda_rest = 0.6, .lambda_loaded = 0.35, .relaxation_s = 0.2});
  const std::vector<Vec3> rest(anchors.positions().begin(), anchors.positions().end());
  for (int tick = 0; tick < 20; ++tick) anchors.update(1, 0.005);
  EXPECT_NEAR(anchors.lambda(), 0.475, 1e-12);  // half way after half the relaxation time
  for (int tick = 0; tick < 40; ++tick) anchors.update(1, 0.005);
  EXPECT_DOUBLE_EQ(anchors.lambda(), 0.35);
  anchors.update(0.37, 0.0123);
  for (int tick = 0; tick < 60; ++tick) anchors.update(0, 0.005);
  EXPECT_EQ(anchors.lambda(), 0.6);
  EXPECT_TRUE(std::equal(rest.begin(), rest.end(), anchors.positions().begin()));
}

}  // namespace
}  // namespace brachy
