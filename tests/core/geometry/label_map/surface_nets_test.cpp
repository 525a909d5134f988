#include "core/geometry/label_map/surface_nets.h"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.h"
#include "tests/core/geometry/simplify/surface_distance.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

/// A net of values given for all nodes, i fastest.
NetSurface net_of(const std::array<std::size_t, 3>& size, const std::vector<float>& values) {
  const std::size_t layer = size[0] * size[1];
  return surface_nets(
      size,
      [&](std::size_t k, std::span<float> out) {
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(k * layer), layer, out.begin());
      },
      0.5F);
}

TEST(SurfaceNets, WrapOneNodeInAnOctahedronsDual) {
  const NetSurface net = net_of({1, 1, 1}, {-0.5F});
  EXPECT_EQ(net.mesh.vertices.size(), 8u);
  EXPECT_TRUE(is_closed_manifold(net.mesh));
  // Three crossings of each cell, half a node away: the mean lies a sixth away along each axis.
  EXPECT_NEAR(signed_volume(net.mesh), std::pow(1.0 / 3, 3), 1e-6);
}

// Noise has every configuration of a cell, and of neighbouring cells.
TEST(SurfaceNets, AreClosedAndManifoldOnNoise) {
  std::mt19937 random(3);
  for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    std::vector<float> values(20 * 20 * 20);
    std::uniform_real_distribution<double> uniform;
    for (float& v : values) v = uniform(random) < share ? -0.5F : 0.5F;
    const NetSurface net = net_of({20, 20, 20}, values);
    EXPECT_TRUE(is_closed_manifold(net.mesh)) << share;
    EXPECT_EQ(net.cells.size(), net.mesh.vertices.size());
    EXPECT_GT(signed_volume(net.mesh), 0) << share;
  }
}

TEST(SurfaceNets, LieOnADistancesZero) {
  std::vector<float> values;
  for (int k = 0; k < 30; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 30; ++i)
        values.push_back(static_cast<float>((Vec3(i, j, k) - Vec3(14.3, 14.6, 14.1)).norm() - 11));
  const NetSurface net = net_of({30, 30, 30}, values);
  EXPECT_TRUE(is_closed_manifold(net.mesh));
  for (const Vec3& v : net.mesh.vertices) EXPECT_NEAR((v - Vec3(14.3, 14.6, 14.1)).norm(), 11, 0.04);
}

TEST(SurfaceNets, RefuseMoreVerticesThanAllowed) {
  const auto fill = [](std::size_t k, std::span<float> layer) {
    for (std::size_t n = 0; n < layer.size(); ++n) layer[n] = (n + k) % 2 == 0 ? -0.5F : 0.5F;
  };
  EXPECT_THROW(surface_nets({30, 30, 30}, fill, 0.5F, 1000), UserError);
}

}  // namespace
}  // namespace brachy
