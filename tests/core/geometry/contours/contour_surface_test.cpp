#include "core/geometry/contours/contour_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>

#include "core/base/error.h"
#include "core/brachytherapy/structures/phantom_structures.h"
#include "core/geometry/contours/mesh_contours.h"
#include "core/geometry/surface/surface_volume.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/geometry/simplify/surface_distance.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

using Contours = std::vector<std::vector<Vec3>>;

std::vector<Vec3> circle(double radius, double z, const Vec2& centre = Vec2::Zero(), int points = 60) {
  std::vector<Vec3> contour;
  for (int n = 0; n < points; ++n) {
    const double a = 2 * std::numbers::pi * n / points;
    contour.emplace_back(centre.x() + radius * std::cos(a), centre.y() + radius * std::sin(a), z);
  }
  return contour;
}

Contours cut(const SurfaceMesh& mesh, double spacing_mm) {
  double least = 1e9, most = -1e9;
  for (const Vec3& v : mesh.vertices) {
    least = std::min(least, v.z());
    most = std::max(most, v.z());
  }
  Contours contours;
  for (const double z : contour_heights(least, most, spacing_mm))
    for (const Polygon& polygon : mesh_contours(mesh, z)) {
      contours.emplace_back();
      for (const Vec2& p : polygon) contours.back().emplace_back(p.x(), p.y(), z);
    }
  return contours;
}

ContourSurface surface_of(const Contours& contours) {
  return contour_surface(stack_contours(contours, "test"), "test");
}

TEST(ContourSurface, GivesThePhantomBackWithinATenthOfAMillimetre) {
  for (const SurfaceMesh& mesh : {prostate_phantom(4000), phantom_urethra(), phantom_rectum()}) {
    const ContourSurface back = surface_of(cut(mesh, 0.25));
    EXPECT_TRUE(is_closed_manifold(back.mesh));
    const SurfaceDistance distance = surface_distance(mesh, back.mesh);
    EXPECT_LT(distance.p95_mm, 0.1);
    EXPECT_LT(distance.most_mm, 0.6);
    EXPECT_NEAR(1e3 * back.surface_cc / enclosed_mm3(mesh), 1, 0.005);
    EXPECT_NEAR(back.surface_cc / back.slabs_cc, 1, 0.01);
  }
}

TEST(ContourSurface, DoesNotDependOnTheOrderOfContoursOrTheirWinding) {
  Contours contours = cut(prostate_phantom(2000), 2);
  const ContourSurface sorted = surface_of(contours);
  std::ranges::shuffle(contours, std::mt19937(1));
  for (std::size_t c = 0; c < contours.size(); c += 2) std::ranges::reverse(contours[c]);
  const ContourSurface shuffled = surface_of(contours);
  EXPECT_LT(surface_distance(sorted.mesh, shuffled.mesh).most_mm, 0.01);
}

TEST(ContourSurface, OfObliquePlanesIsWhereTheyAre) {
  const Mat3 R = Eigen::AngleAxisd(0.5, Vec3(1, -1, 0.3).normalized()).toRotationMatrix();
  const Vec3 shift(-120, 340, -800);
  SurfaceMesh phantom = prostate_phantom(2000);
  Contours contours = cut(phantom, 0.5);
  for (auto& contour : contours)
    for (Vec3& p : contour) p = R * p + shift;
  for (Vec3& v : phantom.vertices) v = R * v + shift;
  EXPECT_LT(surface_distance(phantom, surface_of(contours).mesh).p95_mm, 0.1);
}

TEST(ContourSurface, KeepsHoles) {
  Contours contours;
  for (int z = 0; z <= 10; ++z) {
    contours.push_back(circle(10, z));
    contours.push_back(circle(4, z));
  }
  const ContourSurface tube = surface_of(contours);
  EXPECT_TRUE(is_closed_manifold(tube.mesh));
  // Eleven slabs of 1 mm; the polygons have 60 corners.
  const double share = 60 * std::sin(2 * std::numbers::pi / 60) / 2;
  EXPECT_NEAR(1e3 * tube.surface_cc, 11 * share * (100 - 16), 11 * 264 * 0.01);
  EXPECT_FALSE(SurfaceBvh(tube.mesh).inside(Vec3(0, 0, 5)));
}

TEST(ContourSurface, TakesAChannelToAHoleForNothing) {
  Contours plain, keyhole;
  for (int z = 0; z <= 10; ++z) {
    plain.push_back(circle(10, z));
    plain.push_back(circle(4, z));
    std::vector<Vec3> one = circle(10, z);
    one.push_back(one.front());
    std::vector<Vec3> inner = circle(4, z);
    inner.push_back(inner.front());
    std::ranges::reverse(inner);
    one.insert(one.end(), inner.begin(), inner.end());
    keyhole.push_back(one);
  }
  EXPECT_LT(surface_distance(surface_of(plain).mesh, surface_of(keyhole).mesh).most_mm, 1e-3);
}

TEST(ContourSurface, BridgesMissingPlanesAndReportsThem) {
  Contours contours;
  for (int z = 0; z <= 20; ++z)
    if (z != 7 && z != 8 && z != 13) contours.push_back(circle(10, z));
  const ContourStack stack = stack_contours(contours, "test");
  EXPECT_EQ(stack.missing_planes, 3u);
  const ContourSurface tube = contour_surface(stack, "test");
  EXPECT_TRUE(SurfaceBvh(tube.mesh).inside(Vec3(9, 0, 7.5)));
  EXPECT_NEAR(tube.surface_cc, 1e-3 * 21 * 100 * 60 * std::sin(2 * std::numbers::pi / 60) / 2, 0.05);
}

TEST(ContourSurface, MakesTwoPiecesOfAWideGap) {
  Contours contours;
  for (const int z : {0, 1, 2, 3, 4, 20, 21, 22, 23}) contours.push_back(circle(5, z));
  const ContourSurface two = surface_of(contours);
  EXPECT_TRUE(is_closed_manifold(two.mesh));
  EXPECT_FALSE(SurfaceBvh(two.mesh).inside(Vec3(0, 0, 10)));
  EXPECT_TRUE(SurfaceBvh(two.mesh).inside(Vec3(0, 0, 21)));
}

// Drawn at 1 mm where the structure changes, at 5 mm where it does not.
TEST(ContourSurface, IsOnePieceWherePlanesAreFartherApartThroughout) {
  Contours contours;
  for (const int z : {0, 1, 2, 3, 4, 5, 6, 7, 12, 17, 22, 27}) contours.push_back(circle(10, z));
  const ContourStack stack = stack_contours(contours, "test");
  for (std::size_t plane = 0; plane + 1 < stack.planes.size(); ++plane)
    EXPECT_FALSE(stack.is_piece_end(plane)) << plane;
  const ContourSurface tube = contour_surface(stack, "test");
  EXPECT_NEAR(tube.surface_cc, 1e-3 * 28 * 100 * 60 * std::sin(2 * std::numbers::pi / 60) / 2, 0.05);
}

TEST(ContourSurface, JoinsBranches) {
  Contours contours;
  for (int z = 0; z < 5; ++z) contours.push_back(circle(8, z));
  for (int z = 5; z < 12; ++z) {
    contours.push_back(circle(3, z, {-4, 0}));
    contours.push_back(circle(3, z, {4, 0}));
  }
  const ContourSurface trousers = surface_of(contours);
  EXPECT_TRUE(is_closed_manifold(trousers.mesh));
  const SurfaceBvh bvh(trousers.mesh);
  EXPECT_TRUE(bvh.inside(Vec3(0, 0, 2)));
  EXPECT_FALSE(bvh.inside(Vec3(0, 0, 9)));
  EXPECT_TRUE(bvh.inside(Vec3(4, 0, 9)));
  EXPECT_NEAR(trousers.surface_cc / trousers.slabs_cc, 1, 0.03);
}

// Of 60 corners.
double circle_mm2(double radius) {
  return 30 * std::sin(2 * std::numbers::pi / 60) * radius * radius;
}

Contours tube(double radius, double spacing, int planes, const Vec2& shift) {
  Contours contours;
  for (int k = 0; k < planes; ++k) contours.push_back(circle(radius, k * spacing, k * shift));
  return contours;
}

TEST(ContourSurface, FollowsATubeHoweverThinAndObliqueItRuns) {
  for (const double radius : {1.5, 3.0})
    for (const double spacing : {1.0, 3.0, 5.0})
      for (const double per_mm : {0.0, 0.4, 1.0, 2.4}) {
        const Vec2 shift = per_mm * spacing * Vec2(0.8, -0.6);
        const ContourSurface surface = surface_of(tube(radius, spacing, 9, shift));
        EXPECT_TRUE(is_closed_manifold(surface.mesh));
        EXPECT_NEAR(1e3 * surface.surface_cc / (9 * spacing * circle_mm2(radius)), 1, 0.01)
            << radius << " mm, " << spacing << " mm, " << per_mm;
        const Vec2 between = 4.5 * shift;
        EXPECT_TRUE(SurfaceBvh(surface.mesh).inside(Vec3(between.x(), between.y(), 4.5 * spacing)));
      }
}

TEST(ContourSurface, FollowsTwoTubesThatPartAndOneThatBranches) {
  Contours contours = tube(2, 3, 10, {2, 0});
  for (const auto& contour : tube(2, 3, 10, {-2, 0})) contours.push_back(contour);
  contours.erase(contours.begin());  // the first plane has one outline, which both go on from
  const ContourSurface trousers = surface_of(contours);
  EXPECT_TRUE(is_closed_manifold(trousers.mesh));
  EXPECT_NEAR(trousers.surface_cc / trousers.slabs_cc, 1, 0.01);
  const SurfaceBvh bvh(trousers.mesh);
  for (const double k : {5.5, 8.5}) {
    EXPECT_TRUE(bvh.inside(Vec3(2 * k, 0, 3 * k)));
    EXPECT_TRUE(bvh.inside(Vec3(-2 * k, 0, 3 * k)));
    EXPECT_FALSE(bvh.inside(Vec3(0, 0, 3 * k)));
  }
}

TEST(ContourSurface, DoesNotJoinWhatLiesFarApart) {
  Contours contours = tube(4, 2, 5, {0, 0});
  for (auto contour : tube(4, 2, 5, {0, 0})) {
    for (Vec3& p : contour) p += Vec3(30, 0, 10);
    contours.push_back(contour);
  }
  const ContourSurface two = surface_of(contours);
  EXPECT_NEAR(1e3 * two.surface_cc / (20 * circle_mm2(4)), 1, 0.01);
  EXPECT_FALSE(SurfaceBvh(two.mesh).inside(Vec3(15, 0, 9)));
}

TEST(ContourStack, FindsTheSlicesOfContoursThatLieATenthOfTheSpacingApart) {
  std::mt19937 random(5);
  for (const double spacing : {0.5, 1.0, 3.0}) {
    std::uniform_real_distribution<double> jitter(-0.1 * spacing, 0.1 * spacing);
    Contours contours;
    for (int k = 0; k < 12; ++k) {
      contours.push_back(circle(12, k * spacing + jitter(random)));
      contours.push_back(circle(7, k * spacing + jitter(random)));
    }
    EXPECT_EQ(stack_contours(contours, "test").planes.size(), 12u) << spacing;
    EXPECT_NEAR(1e3 * surface_of(contours).surface_cc / (12 * spacing * (circle_mm2(12) - circle_mm2(7))), 1,
                0.02);
  }
}

// A patient's outline is in most structure sets: as fine as an organ it would take longer than all organs together.
TEST(ContourSurface, OfATrunkHasNoFinerGridThanItNeeds) {
  Contours trunk;
  const auto radius = [](double z) { return 180 - z * z / 4000; };
  for (int slice = -100; slice <= 100; ++slice)
    trunk.push_back(circle(radius(2 * slice), 2 * slice, {30, -250}, 400));
  const ContourSurface surface = surface_of(trunk);
  EXPECT_TRUE(is_closed_manifold(surface.mesh));
  EXPECT_LT(surface.mesh.vertices.size(), 150'000u);
  EXPECT_NEAR(surface.surface_cc / surface.slabs_cc, 1, 0.001);
  for (const Vec3& v : surface.mesh.vertices)
    if (std::abs(v.z()) < 200) {
      ASSERT_NEAR((v.head<2>() - Vec2(30, -250)).norm(), radius(v.z()), 0.1) << v.transpose();
    }
}

TEST(ContourSurface, MakesASlabOfOnePlane) {
  const ContourSurface slab = surface_of({circle(10, 3)});
  EXPECT_TRUE(is_closed_manifold(slab.mesh));
  EXPECT_NEAR(slab.surface_cc, 0.314, 0.005);
}

TEST(ContourStack, TakesARepeatedContourOnce) {
  const ContourStack stack = stack_contours(Contours{circle(10, 0), circle(10, 0), circle(10, 1)}, "test");
  EXPECT_EQ(stack.repeated, 1u);
  EXPECT_EQ(stack.planes.size(), 2u);
}

TEST(ContourStack, CountsPlanesInWhichContoursCross) {
  const Contours contours = {circle(10, 0),
                             circle(10, 0, {8, 0}),  // cross
                             circle(10, 1),
                             circle(5, 1),  // a hole
                             circle(10, 2),
                             circle(10, 2, {40, 0}),             // apart
                             {{0, 0, 3}, {4, 0, 3}, {0, 4, 3}},  // touch in a corner and along an edge
                             {{0, 0, 3}, {-4, 0, 3}, {0, -4, 3}},
                             {{0, 4, 3}, {4, 0, 3}, {4, 4, 3}}};
  EXPECT_EQ(stack_contours(contours, "test").crossing_planes, 1u);
}

TEST(ContourStack, KeepsSlicesOfTheirOwnThatAreFinerThanTheImages) {
  Contours contours;
  for (int k = 0; k < 60; ++k) contours.push_back(circle(10, 0.25 * k));
  const ContourStack stack = stack_contours(contours, "test", {Vec3::UnitZ(), 5});
  EXPECT_EQ(stack.planes.size(), 60u);
  EXPECT_EQ(stack.repeated, 0u);
}

TEST(ContourStack, RefusesAContourOfMorePointsThanItCanLookThrough) {
  EXPECT_NO_THROW(stack_contours(Contours{circle(10, 0, {0, 0}, 500)}, "test"));
  EXPECT_THROW(
      stack_contours(Contours{circle(10, 0, {0, 0}, static_cast<int>(kMostContourPoints) + 1)}, "test"),
      UserError);
}

TEST(ContourStack, RefusesWhatIsNoStack) {
  std::vector<Vec3> bent = circle(10, 0);
  bent[5].z() = 3;
  for (const Contours& bad : {Contours{}, Contours{{{0, 0, 0}, {1, 0, 0}}}, Contours{circle(10, 0), bent},
                              Contours{circle(10, std::nan(""))}, Contours{circle(10, 1e7)}})
    EXPECT_THROW(stack_contours(bad, "test"), UserError);
}

TEST(MeshContours, CutABoxInItsRectangle) {
  const auto polygons = mesh_contours(make_box({0, 0, 0}, {10, 20, 30}), 30);
  EXPECT_TRUE(polygons.empty() || polygons.front().size() >= 4);
  const auto middle = mesh_contours(make_box({0, 0, 0}, {10, 20, 30}), 12);
  ASSERT_EQ(middle.size(), 1u);
  for (const Vec2& p : middle.front())
    EXPECT_TRUE(p.x() == 0 || p.x() == 10 || p.y() == 0 || p.y() == 20) << p.transpose();
}

}  // namespace
}  // namespace brachy
