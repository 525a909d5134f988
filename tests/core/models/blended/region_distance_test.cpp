#include "core/models/blended/region_distance.h"

#include <gtest/gtest.h>

#include "core/elasticity/elastic_body.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

using test::uniform_point;

// Largest difference of the gradient from central differences where the distance is smaller than `deep`.
double gradient_error(const RegionDistance& region, double half_width, double deep) {
  std::mt19937_64 random(3);
  double worst = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 X = uniform_point(random, half_width);
    Vec3 gradient, differences;
    if (region.at(X, &gradient) < -deep) continue;
    constexpr double kStep = 1e-4;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 h = kStep * Vec3::Unit(axis);
      differences[axis] = (region.at(X + h) - region.at(X - h)) / (2 * kStep);
    }
    worst = std::max(worst, (gradient - differences).norm());
  }
  return worst;
}

// Values, and first to third differences along lines in random balls, against the bounds of `over` for the ball;
// differences where the distance is not below −deep nor above `high`.
void expect_bounds(const RegionDistance& region, double half_width, double deep, double high = 100) {
  std::mt19937_64 random(4);
  int known = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 X = uniform_point(random, half_width);
    const double radius = test::uniform(random, 0.05, 2);
    const DistanceBounds bounds = region.over(X, radius);
    const Vec3 at = X + radius * test::uniform(random, 0, 0.9) * uniform_point(random, 1).normalized();
    const double d = region.at(at);
    ASSERT_LE(bounds.least, d + 1e-9);
    ASSERT_GE(bounds.most, d - 1e-9);
    if (bounds.least < -deep || bounds.most > high || bounds.slope[2] > 1e29) continue;
    ++known;
    const Vec3 v = uniform_point(random, 1).normalized();
    const double h = 0.02 * radius;
    const auto f = [&](int steps) { return region.at(at + steps * h * v); };
    ASSERT_LE(std::abs(f(1) - f(-1)) / (2 * h), bounds.slope[0] * (1 + 1e-6) + 1e-9);
    ASSERT_LE(std::abs(f(1) - 2 * f(0) + f(-1)) / (h * h), bounds.slope[1] * (1 + 1e-3) + 1e-6);
    ASSERT_LE(std::abs(f(3) - 3 * f(1) + 3 * f(-1) - f(-3)) / (8 * h * h * h),
              bounds.slope[2] * (1 + 1e-2) + 1e-3);
  }
  EXPECT_GT(known, 300);
}

TEST(EllipsoidDistance, OfASphereIsExact) {
  const Vec3 centre(1, -2, 3);
  const EllipsoidDistance sphere(centre, Vec3::Constant(7));
  std::mt19937_64 random(1);
  for (int k = 0; k < 100; ++k) {
    const Vec3 X = uniform_point(random, 20);
    EXPECT_NEAR(sphere.at(X), (X - centre).norm() - 7, 1e-12);
  }
  Vec3 gradient(1, 1, 1);
  EXPECT_EQ(sphere.at(centre, &gradient), -7);
  EXPECT_EQ(gradient, Vec3(0, 0, 0));
  const DistanceBounds bounds = sphere.over(centre + Vec3(8, 0, 0), 0.5);
  EXPECT_EQ(bounds.slope[0], 1);
  EXPECT_NEAR(bounds.slope[1], 1 / 7.5, 1e-12);
}

// Along the normal, where the nearest point is known as long as it is nearer than the least radius of
// curvature, 18²/24.
TEST(EllipsoidDistance, IsRightToFirstOrder) {
  const Vec3 axes(24, 18, 21);
  const EllipsoidDistance region(Vec3::Zero(), axes);
  for (const SurfacePatch& patch : EllipsoidRegion(Vec3::Zero(), axes, 1).surface(200)) {
    EXPECT_NEAR(region.at(patch.position), 0, 1e-12);
    Vec3 gradient;
    region.at(patch.position, &gradient);
    EXPECT_LT((gradient - patch.normal).norm(), 1e-12);
    for (const double d : {-5.0, -2.5, -0.1, 0.1, 2.5, 5.0})
      EXPECT_NEAR(region.at(patch.position + d * patch.normal), d, 0.02 * std::abs(d)) << d;
  }
}

TEST(EllipsoidDistance, IsDeepEverywhereAboutItsCentre) {
  const EllipsoidDistance region(Vec3::Zero(), Vec3(30, 4, 12));
  std::mt19937_64 random(2);
  for (int k = 0; k < 300; ++k) {
    const Vec3 y = uniform_point(random, 1);
    if (y.norm() >= 1) continue;
    EXPECT_LE(region.at(y.cwiseProduct(Vec3(30, 4, 12))), -4 * (1 - y.norm()) + 1e-12);
  }
}

TEST(EllipsoidDistance, GradientAndBoundsAreThoseOfTheDistance) {
  const EllipsoidDistance region(Vec3(1, 2, 3), Vec3(24, 12, 18));
  EXPECT_LT(gradient_error(region, 30, 10), 1e-6);
  expect_bounds(region, 30, 10);
  expect_bounds(EllipsoidDistance(Vec3(1, 2, 3), Vec3::Constant(9)), 14, 8);
  expect_bounds(EllipsoidDistance(Vec3::Zero(), Vec3(15, 3, 6)), 15, 2.5);
}

struct GlandDistance : testing::Test {
  static constexpr double kBlend = 10;
  const SurfaceBvh surface{prostate_phantom(400)};
  const SampledDistance region{surface, kBlend};
};

TEST_F(GlandDistance, IsNearlyThatOfTheSurface) {
  std::mt19937_64 random(5);
  double worst = 0;
  for (int k = 0; k < 1000; ++k) {
    const Vec3 X = uniform_point(random, 32);
    const double exact = surface.closest_point(X).signed_distance, d = region.at(X);
    if (std::abs(exact) < 0.5 * kBlend)
      worst = std::max(worst, std::abs(d - exact));
    else
      ASSERT_GT(d * (exact > 0 ? 1 : -1), 0.45 * kBlend) << exact;  // in or out of the blend alike
  }
  EXPECT_LT(worst, 2.5 / 8);  // of a cell
  EXPECT_GT(region.at({500, 0, 0}), 0.5 * kBlend);
}

TEST_F(GlandDistance, GradientAndBoundsAreThoseOfTheDistance) {
  EXPECT_LT(gradient_error(region, 32, 100), 1e-5);
  expect_bounds(region, 32, 0.5 * kBlend, 0.5 * kBlend);
}

}  // namespace
}  // namespace brachy
