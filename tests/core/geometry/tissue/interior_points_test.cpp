#include "core/geometry/tissue/interior_points.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/geometry/tissue/phantom.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

TEST(InteriorPoints, AreAsManyAsAskedAndAllInside) {
  const SurfaceBvh bvh(prostate_phantom());
  const std::vector<Vec3> points = fill_interior(bvh, 13'360, 1);
  ASSERT_EQ(points.size(), 13'360u);  // 14,560 with the surface's 1,200
  for (const Vec3& p : points) ASSERT_LT(bvh.closest_point(p).signed_distance, 0);
  EXPECT_TRUE(fill_interior(bvh, 0, 1).empty());
}

TEST(InteriorPoints, FillTheVolumeMoreEvenlyThanChance) {
  // A box is its own bounding box: 4³ cells of 125 points each on average.
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  for (const std::uint64_t seed : {0u, 1u, 12345u}) {
    std::array<int, 64> cells{};
    for (const Vec3& p : fill_interior(bvh, 8000, seed)) {
      ++cells[static_cast<std::size_t>(p.x()) + 4 * static_cast<std::size_t>(p.y()) +
              16 * static_cast<std::size_t>(p.z())];
    }
    double square_sum = 0;
    for (const int cell : cells) square_sum += (cell - 125.0) * (cell - 125.0);
    EXPECT_LT(std::sqrt(square_sum / 64), 6) << seed;  // chance: 11
  }
}

TEST(InteriorPoints, KeepTheirDistanceFromEachOther) {
  const SurfaceBvh bvh(prostate_phantom());
  const std::vector<Vec3> points = fill_interior(bvh, 2000, 1);
  const double spacing = std::cbrt(47'000.0 / 2000);  // mm, of a cubic grid as dense
  double least = 1e300, mean = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double nearest = 1e300;
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (i != j) nearest = std::min(nearest, (points[i] - points[j]).norm());
    }
    least = std::min(least, nearest);
    mean += nearest / static_cast<double>(points.size());
  }
  EXPECT_GT(least, 0.3 * spacing);  // chance: 0.03
  EXPECT_GT(mean, 0.7 * spacing);   // chance: 0.55
}

TEST(InteriorPoints, FollowFromTheSeed) {
  const SurfaceBvh bvh(prostate_phantom());
  EXPECT_EQ(fill_interior(bvh, 500, 7), fill_interior(bvh, 500, 7));
  EXPECT_NE(fill_interior(bvh, 500, 7), fill_interior(bvh, 500, 8));
  const std::vector<Vec3> more = fill_interior(bvh, 600, 7), fewer = fill_interior(bvh, 500, 7);
  EXPECT_TRUE(std::equal(fewer.begin(), fewer.end(), more.begin()));
}

TEST(InteriorPoints, AreTheSameOnEveryMachine) {
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  const Vec3 first = fill_interior(bvh, 1, 1)[0];
  // From Python's integers: splitmix64 from seed 1, one step of the sequence, over the box.
  EXPECT_NEAR(first.x(), 1.542936354, 1e-7);
  EXPECT_NEAR(first.y(), 1.667301456, 1e-7);
  EXPECT_NEAR(first.z(), 2.082812926, 1e-7);
}

TEST(InteriorPoints, RefuseAnAbsurdCount) {
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  const std::string message =
      user_error([&] { fill_interior(bvh, std::numeric_limits<std::size_t>::max(), 1, "gland.stl"); });
  EXPECT_EQ(message.find("gland.stl: "), 0u) << message;
  user_error([&] { fill_interior(bvh, kMaxInteriorPoints + 1, 1); });
}

TEST(InteriorPoints, GiveUpOnAnAllButEmptyBox) {
  // Two specks at opposite corners of a large box.
  const SurfaceMesh specks =
      joined(make_box({0, 0, 0}, {0.1, 0.1, 0.1}), make_box({99, 99, 99}, {99.1, 99.1, 99.1}));
  EXPECT_NE(user_error([&] { fill_interior(SurfaceBvh(specks), 100, 1, "specks.stl"); }).find("specks.stl"),
            std::string::npos);
}

}  // namespace
}  // namespace brachy
