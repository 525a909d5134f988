#include "core/geometry/tissue/tissue.h"

#include <gtest/gtest.h>

#include "core/geometry/tissue/interior_points.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

struct Parts {
  SurfaceMesh surface = prostate_phantom();
  std::vector<Vec3> interior = fill_interior(SurfaceBvh(surface), 13'360, 1);
  Tissue tissue = build_tissue(surface, interior);
};

TEST(Tissue, HoldsEveryPointOnceSurfaceFirst) {
  const Parts parts;
  ASSERT_EQ(parts.tissue.surface_count, 1200u);
  ASSERT_EQ(parts.tissue.size(), 14'560u);
  const auto less = [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  const auto sorted = [&](std::vector<Vec3> points) {
    std::sort(points.begin(), points.end(), less);
    return points;
  };
  const auto middle = parts.tissue.rest_vertices.begin() + 1200;
  EXPECT_EQ(sorted({parts.tissue.rest_vertices.begin(), middle}), sorted(parts.surface.vertices));
  EXPECT_EQ(sorted({middle, parts.tissue.rest_vertices.end()}), sorted(parts.interior));
}

TEST(Tissue, TrianglesKeepTheirOrderAndCorners) {
  const Parts parts;
  ASSERT_EQ(parts.tissue.triangles.size(), parts.surface.triangles.size());
  for (std::size_t t = 0; t < parts.surface.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_LT(parts.tissue.triangles[t][k], parts.tissue.surface_count);
      ASSERT_EQ(parts.tissue.rest_vertices[parts.tissue.triangles[t][k]],
                parts.surface.vertices[parts.surface.triangles[t][k]]);
    }
  }
}

TEST(Tissue, BlocksCoverEveryPointOnceAndDoNotStraddle) {
  const Parts parts;
  std::uint32_t next = 0;
  for (const Block& block : parts.tissue.blocks) {
    EXPECT_EQ(block.first, next);
    EXPECT_GT(block.count, 0u);
    EXPECT_LE(block.count, Tissue::kBlockSize);
    next += block.count;
    EXPECT_TRUE(next <= 1200 || block.first >= 1200) << block.first;
    Vec3 min = parts.tissue.rest_vertices[block.first], max = min;
    for (std::uint32_t i = block.first; i < next; ++i) {
      min = min.cwiseMin(parts.tissue.rest_vertices[i]);
      max = max.cwiseMax(parts.tissue.rest_vertices[i]);
    }
    EXPECT_EQ(block.min, min);
    EXPECT_EQ(block.max, max);
  }
  EXPECT_EQ(next, parts.tissue.size());
  EXPECT_EQ(parts.tissue.blocks.size(), 19u + 209u);
}

TEST(Tissue, BlocksAreCompact) {
  const Parts parts;
  double volume = 0;
  for (const Block& block : parts.tissue.blocks) {
    if (block.first >= parts.tissue.surface_count) volume += (block.max - block.min).prod();
  }
  EXPECT_LT(volume,
            5 * 47'000);  // the gland's is 47,000 mm³; unsorted, all blocks together have over 200 times it
}

TEST(Tissue, IsTheSameEveryTimeAndForAnyOrderOfTheInteriorPoints) {
  const Parts parts;
  std::vector<Vec3> reversed(parts.interior.rbegin(), parts.interior.rend());
  EXPECT_EQ(build_tissue(parts.surface, reversed).rest_vertices, parts.tissue.rest_vertices);
}

TEST(Tissue, TakesPartsThatAreEmptyOrOnePoint) {
  EXPECT_EQ(build_tissue({}, {}).blocks.size(), 0u);
  const Tissue single = build_tissue({}, {Vec3(1, 2, 3)});
  ASSERT_EQ(single.blocks.size(), 1u);
  EXPECT_EQ(single.blocks[0].min, Vec3(1, 2, 3));
  const Tissue equal = build_tissue({}, std::vector<Vec3>(65, Vec3(1, 2, 3)));
  ASSERT_EQ(equal.blocks.size(), 2u);
  EXPECT_EQ(equal.blocks[1].count, 1u);
}

}  // namespace
}  // namespace brachy
