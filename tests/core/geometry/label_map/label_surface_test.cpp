#include "core/geometry/label_map/label_surface.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/geometry/label_map/rasterise.h"
#include "core/geometry/surface/surface_volume.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/geometry/simplify/surface_distance.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

Mat3 turned(const Vec3& spacing) {
  return Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix() * spacing.asDiagonal();
}

/// A grid with these steps about the phantom, moved by `shift` in the world.
VoxelGrid grid_about_phantom(const Mat3& steps, const std::array<std::size_t, 3>& size, const Vec3& shift) {
  VoxelGrid grid{size, Vec3::Zero(), steps};
  const Vec3 middle = 0.5 * Vec3(static_cast<double>(size[0] - 1), static_cast<double>(size[1] - 1),
                                 static_cast<double>(size[2] - 1));
  grid.origin = shift - steps * middle;
  return grid;
}

SurfaceMesh shifted_phantom(const Vec3& shift) {
  SurfaceMesh phantom = prostate_phantom(4000);
  for (Vec3& v : phantom.vertices) v += shift;
  return phantom;
}

void expect_same_as_phantom(const VoxelGrid& grid, const Vec3& shift, double p95_mm) {
  const SurfaceMesh phantom = shifted_phantom(shift);
  std::vector<std::uint16_t> labels(grid.count(), 0);
  const std::size_t set = rasterise(SurfaceBvh(phantom), grid, 7, labels);
  const LabelSurface surface = label_surface(grid, labels, 7);
  EXPECT_EQ(surface.voxels, set);
  EXPECT_TRUE(is_closed_manifold(surface.mesh));
  EXPECT_NEAR(surface.surface_cc / surface.voxels_cc, 1, 0.002);
  EXPECT_NEAR(surface.surface_cc * 1e3 / enclosed_mm3(phantom), 1, 0.01);
  EXPECT_LT(surface_distance(phantom, surface.mesh).p95_mm, p95_mm);
}

TEST(LabelSurface, OfIsotropicVoxelsIsThePhantomsWithinAThirdOfAVoxel) {
  expect_same_as_phantom(grid_about_phantom(Mat3::Identity(), {60, 50, 55}, Vec3::Zero()), Vec3::Zero(), 0.3);
}

TEST(LabelSurface, OfObliqueAnisotropicVoxelsFarFromTheOriginIsWhereThePhantomIs) {
  const Vec3 far(-153.2, 97.4, 1203.6);
  expect_same_as_phantom(grid_about_phantom(turned({0.7, 0.7, 2.5}), {100, 90, 32}, far), far, 0.6);
}

TEST(LabelSurface, OfALeftHandedGridIsWoundOutward) {
  const Mat3 steps = Vec3(-1, 1, 1.5).asDiagonal();
  expect_same_as_phantom(grid_about_phantom(steps, {60, 50, 40}, Vec3::Zero()), Vec3::Zero(), 0.4);
}

TEST(LabelSurface, ClosesWhatTheGridsBorderCuts) {
  const VoxelGrid grid{{4, 5, 6}, Vec3(10, 20, 30), Mat3::Identity()};
  const std::vector<std::uint16_t> labels(grid.count(), 1);
  const LabelSurface surface = label_surface(grid, labels, 1, {.smoothing_steps = 0});
  EXPECT_TRUE(is_closed_manifold(surface.mesh));
  EXPECT_NEAR(surface.surface_cc, 0.12, 0.0002);
  const SurfaceBvh bvh(surface.mesh);
  EXPECT_NEAR(bvh.min().x(), 9.5, 0.15);
  EXPECT_NEAR(bvh.max().z(), 35.5, 0.15);
}

TEST(LabelSurface, KeepsACavity) {
  const VoxelGrid grid{{20, 20, 20}, Vec3::Zero(), Mat3::Identity()};
  std::vector<std::uint16_t> labels(grid.count(), 0);
  for (std::size_t k = 2; k < 18; ++k)
    for (std::size_t j = 2; j < 18; ++j)
      for (std::size_t i = 2; i < 18; ++i) {
        const auto in = [](std::size_t n) { return n >= 7 && n < 13; };
        labels[grid.index(i, j, k)] = in(i) && in(j) && in(k) ? 0 : 1;
      }
  const LabelSurface surface = label_surface(grid, labels, 1);
  EXPECT_TRUE(is_closed_manifold(surface.mesh));
  EXPECT_NEAR(surface.surface_cc, surface.voxels_cc, 0.002 * surface.voxels_cc);
  EXPECT_FALSE(SurfaceBvh(surface.mesh).inside(Vec3(9.5, 9.5, 9.5)));
  EXPECT_TRUE(SurfaceBvh(surface.mesh).inside(Vec3(4, 4, 4)));
}

TEST(LabelSurface, RefusesALabelThatNoVoxelHas) {
  const VoxelGrid grid{{3, 3, 3}, Vec3::Zero(), Mat3::Identity()};
  const std::vector<std::uint16_t> labels(grid.count(), 1);
  EXPECT_THROW(label_surface(grid, labels, 2), UserError);
}

TEST(Rasterise, SetsTheVoxelsWhoseCentresAreInside) {
  const SurfaceBvh box(make_box({-0.4, 0.6, 0.6}, {3.4, 2.4, 5.4}));
  const VoxelGrid grid{{10, 10, 10}, Vec3::Zero(), Mat3::Identity()};
  std::vector<std::uint16_t> labels(grid.count(), 0);
  EXPECT_EQ(rasterise(box, grid, 3, labels), 4u * 2 * 5);  // its first columns are those of the grid
  EXPECT_EQ(labels[grid.index(0, 1, 1)], 3);
  EXPECT_EQ(labels[grid.index(3, 2, 5)], 3);
  EXPECT_EQ(labels[grid.index(4, 2, 5)], 0);
}

// Smoothing leaves a quarter of it, or less of one that is long.
TEST(LabelSurface, OfAVoxelByItselfKeepsItsVolume) {
  VoxelGrid grid{{5, 5, 5}, Vec3::Zero(), Vec3(1, 0.5, 2).asDiagonal().toDenseMatrix()};
  std::vector<std::uint16_t> labels(grid.count(), 0);
  labels[grid.index(2, 2, 2)] = 3;
  const LabelSurface surface = label_surface(grid, labels, 3);
  EXPECT_NEAR(surface.surface_cc, 0.001, 1e-5);
}

}  // namespace
}  // namespace brachy
