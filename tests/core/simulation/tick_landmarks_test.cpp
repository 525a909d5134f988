#include "core/simulation/tick_landmarks.h"

#include <gtest/gtest.h>

#include "tests/core/simulation/tick_parts.h"

namespace brachy {
namespace {

using test::TickParts;

TEST(TickLandmarks, WithoutContactThereAreNoneNotEvenAnchors) {
  Scene scene = TickParts::small_phantom();
  scene.model.kernel = "psi31";
  TickParts parts(scene);
  parts.step({{8, -4, -60}});
  EXPECT_TRUE(parts.landmarks.set().positions.empty());
  for (double z = -40; z <= 0; z += 0.5) parts.step({{8, -4, z}});
  EXPECT_EQ(parts.landmarks.set().anchors, 8u);
  EXPECT_GT(parts.landmarks.set().positions.size(), 8u);
}

// Shafts before tips, needle after needle; owners say whose each is.
TEST(TickLandmarks, TipsComeLast) {
  Scene scene = TickParts::small_phantom();
  scene.needle.count = 2;
  TickParts parts(scene);
  for (double z = -40; z <= 0; z += 0.5) parts.step({{8, -4, z}, {-8, -4, z}});
  const LandmarkSet& set = parts.landmarks.set();
  ASSERT_EQ(set.owners.size() + set.anchors, set.positions.size());
  ASSERT_GE(set.owners.size(), 4u);
  const std::size_t last = set.owners.size() - 1;
  EXPECT_EQ(set.owners[last - 1].needle, 0u);
  EXPECT_EQ(set.owners[last].needle, 1u);
  for (std::size_t i = 0; i < set.owners.size(); ++i) {
    const auto of_needle = parts.instruments.needles()[set.owners[i].needle].landmarks();
    EXPECT_EQ(of_needle[set.owners[i].index].position, set.positions[set.anchors + i]);
    const bool is_tip = set.owners[i].index + 1 == of_needle.size();
    EXPECT_EQ(is_tip, i + 2 > last) << i;
  }
  // A tip knows the landmark behind it on its own shaft.
  const std::int32_t behind = set.spreads[set.anchors + last].behind;
  ASSERT_GE(behind, 0);
  EXPECT_EQ(set.owners[static_cast<std::size_t>(behind) - set.anchors].needle, 1u);
}

TEST(TickLandmarks, ANeedleThatRestsHasNotChanged) {
  TickParts parts;
  for (double z = -40; z <= 0; z += 0.5) parts.step({{8, -4, z}});
  const std::uint64_t moving = parts.landmarks.set().revision().positions;
  parts.step({{8, -4, 0.5}});
  EXPECT_NE(parts.landmarks.set().revision().positions, moving);
  for (int i = 0; i < 5; ++i) parts.step({{8, -4, 0.5}});
  const std::uint64_t resting = parts.landmarks.set().revision().positions;
  parts.step({{8, -4, 0.5}});
  EXPECT_EQ(parts.landmarks.set().revision().positions, resting);
}

// An anchor in a needle's way is moved beside it, not left out.
TEST(TickLandmarks, AnchorsKeepClearOfNeedles) {
  Scene scene = TickParts::small_phantom();
  scene.model.kernel = "psi31";
  TickParts parts(scene);
  const Vec3 anchor = parts.model->anchors.positions()[0];
  for (double z = anchor.z() - 40; z <= anchor.z() + 2; z += 0.5) parts.step({{anchor.x(), anchor.y(), z}});
  const LandmarkSet& set = parts.landmarks.set();
  ASSERT_EQ(set.anchors, 8u);
  for (std::size_t i = 0; i < set.anchors; ++i) {
    const double distance = (set.positions[i] - anchor).head<2>().norm();
    EXPECT_GE(distance, scene.anchors.clearance_mm - 1e-9) << i;
  }
}

}  // namespace
}  // namespace brachy
