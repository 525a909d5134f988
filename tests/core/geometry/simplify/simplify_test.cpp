#include "core/geometry/simplify/simplify.h"

#include <gtest/gtest.h>

#include "core/geometry/tissue/phantom.h"
#include "tests/core/geometry/simplify/surface_distance.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

TEST(Simplify, KeepsAPhantomClosedAndWithinTheTolerance) {
  const SurfaceMesh fine = prostate_phantom(20'000);
  const SurfaceMesh coarse = simplify(fine, {.tolerance_mm = 0.03});
  EXPECT_LT(coarse.vertices.size(), 3000u);
  EXPECT_TRUE(is_closed_manifold(coarse));
  const SurfaceDistance distance = surface_distance(fine, coarse);
  EXPECT_LT(distance.p95_mm, 0.06);
  EXPECT_LT(distance.most_mm, 0.25);
  EXPECT_NEAR(signed_volume(coarse) / signed_volume(fine), 1, 1e-3);
}

TEST(Simplify, LeavesABoxItsCorners) {
  const SurfaceMesh box = make_box({0, 0, 0}, {10, 20, 30});
  const SurfaceMesh same = simplify(box, {.tolerance_mm = 0.01, .least_vertices = 4});
  EXPECT_EQ(same.vertices.size(), 8u);
  EXPECT_NEAR(signed_volume(same), 6000, 1e-9);
}

TEST(Simplify, StopsAtTheLeastNumberOfVertices) {
  const SurfaceMesh coarse = simplify(prostate_phantom(2000), {.tolerance_mm = 100, .least_vertices = 500});
  EXPECT_EQ(coarse.vertices.size(), 500u);
  EXPECT_TRUE(is_closed_manifold(coarse));
}

TEST(Simplify, GivesTheSameBitsAgain) {
  const SurfaceMesh fine = prostate_phantom(3000);
  const SurfaceMesh a = simplify(fine), b = simplify(fine);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
}

}  // namespace
}  // namespace brachy
