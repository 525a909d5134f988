#include "core/tissue/region.h"

#include <gtest/gtest.h>

#include "core/tissue/phantom.h"
#include "tests/core/rbf/random_landmarks.h"

namespace brachy {
namespace {

using test::uniform_point;

// Largest difference of the gradient from central differences, at points that are `clear` of where it jumps.
template <class IsClear>
double gradient_error(const Region& region, double half_width, const IsClear& is_clear) {
  std::mt19937_64 random(3);
  double worst = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 X = uniform_point(random, half_width);
    if (!is_clear(X)) continue;
    Vec3 gradient, differences;
    region.signed_distance(X, &gradient);
    constexpr double kStep = 1e-4;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 h = kStep * Vec3::Unit(axis);
      differences[axis] = (region.signed_distance(X + h) - region.signed_distance(X - h)) / (2 * kStep);
    }
    worst = std::max(worst, (gradient - differences).norm());
  }
  return worst;
}

TEST(EllipsoidRegion, DistanceOfASphereIsExact) {
  const Vec3 centre(1, -2, 3);
  const EllipsoidRegion sphere(centre, Vec3::Constant(7), 1);
  std::mt19937_64 random(1);
  for (int k = 0; k < 100; ++k) {
    const Vec3 X = uniform_point(random, 20);
    EXPECT_NEAR(sphere.signed_distance(X), (X - centre).norm() - 7, 1e-12);
  }
  Vec3 gradient(1, 1, 1);
  EXPECT_EQ(sphere.signed_distance(centre, &gradient), -7);
  EXPECT_EQ(gradient, Vec3(0, 0, 0));
}

// Along the normal, where the nearest point is known as long as it is nearer than the least radius of curvature, 18²/24.
TEST(EllipsoidRegion, DistanceIsRightToFirstOrder) {
  const Vec3 axes(24, 18, 21);
  const EllipsoidRegion region(Vec3::Zero(), axes, 1);
  for (const SurfacePatch& patch : region.surface(200)) {
    EXPECT_NEAR(region.signed_distance(patch.position), 0, 1e-12);
    Vec3 gradient;
    region.signed_distance(patch.position, &gradient);
    EXPECT_LT((gradient - patch.normal).norm(), 1e-12);
    for (const double d : {-5.0, -2.5, -0.1, 0.1, 2.5, 5.0})
      EXPECT_NEAR(region.signed_distance(patch.position + d * patch.normal), d, 0.02 * std::abs(d)) << d;
  }
}

TEST(EllipsoidRegion, IsDeepEverywhereAboutItsCentre) {
  const EllipsoidRegion region(Vec3::Zero(), Vec3(30, 4, 12), 1);
  std::mt19937_64 random(2);
  for (int k = 0; k < 300; ++k) {
    const Vec3 y = uniform_point(random, 1);
    if (y.norm() >= 1) continue;
    EXPECT_LE(region.signed_distance(y.cwiseProduct(Vec3(30, 4, 12))), -4 * (1 - y.norm()) + 1e-12);
  }
}

TEST(EllipsoidRegion, GradientIsThatOfTheDistance) {
  const EllipsoidRegion region(Vec3(1, 2, 3), Vec3(24, 12, 18), 1);
  EXPECT_LT(gradient_error(region, 30, [](const Vec3& X) { return (X - Vec3(1, 2, 3)).norm() > 1; }), 1e-6);
}

TEST(MeshRegion, DistanceAndGradientAreThoseOfTheSurface) {
  const SurfaceMesh mesh = prostate_phantom(400);
  const MeshRegion region(mesh, 1);
  const double inside = region.signed_distance(Vec3::Zero());
  EXPECT_LT(inside, -10);
  EXPECT_GT(region.signed_distance(Vec3(0, 0, 60)), 30);
  EXPECT_NEAR(region.signed_distance(mesh.vertices[7]), 0, 1e-9);
  // Within a few mm of the surface; the medial axis of the gland is deeper.
  const auto near_surface = [&](const Vec3& X) {
    const double d = std::abs(region.signed_distance(X));
    return d > 0.01 && d < 3;
  };
  EXPECT_LT(gradient_error(region, 24, near_surface), 1e-3);
}

}  // namespace
}  // namespace brachy
