#include "core/simulation/shown_mesh.h"

#include <gtest/gtest.h>

#include "core/scene/load_tissue.h"
#include "tests/core/simulation/tick_parts.h"

namespace brachy {
namespace {

const Tissue& few_points() {
  static const Tissue tissue = load_tissue(test::TickParts::small_phantom()).tissue;
  return tissue;
}

DeformedMesh slot_at_rest(const ShownMesh& mesh) {
  return {mesh.rest(), std::vector<std::uint64_t>(few_points().blocks.size())};
}

Eigen::Vector3f first_point_of(const std::vector<float>& vertices, std::uint32_t block) {
  return Eigen::Map<const Eigen::Vector3f>(&vertices[3 * few_points().blocks[block].first]);
}

TEST(ShownMesh, PutsBlocksInReachAndTakesThemBackToRest) {
  ShownMesh mesh(few_points());
  DeformedMesh slot = slot_at_rest(mesh);
  test::MovedBlocks field(few_points().blocks.size());
  mesh.begin(1);
  field.move(3, {0, 0, 2});
  field.move(5, {1, 0, 0});
  mesh.show(field, {});
  mesh.write(0, slot);
  EXPECT_EQ(first_point_of(slot.deformed_vertices, 3),
            first_point_of(mesh.rest(), 3) + Eigen::Vector3f(0, 0, 2));
  EXPECT_EQ(first_point_of(slot.deformed_vertices, 4), first_point_of(mesh.rest(), 4));
  EXPECT_EQ(slot.block_ticks[3], 1u);
  EXPECT_EQ(slot.block_ticks[4], 0u);
  EXPECT_EQ(mesh.max_displacement_mm(), 2);
  EXPECT_EQ(mesh.moved_vertices(), few_points().blocks[3].count + few_points().blocks[5].count);

  mesh.begin(2);
  field.rest();
  mesh.show(field, {});
  mesh.write(1, slot);
  EXPECT_EQ(slot.deformed_vertices, mesh.rest());
  EXPECT_EQ(slot.block_ticks[3], 2u);
  EXPECT_EQ(mesh.moved_vertices(), 0u);
}

TEST(ShownMesh, WhatHasNotChangedKeepsItsTick) {
  ShownMesh mesh(few_points());
  DeformedMesh slot = slot_at_rest(mesh);
  test::MovedBlocks field(few_points().blocks.size());
  field.move(3, {0, 0, 2});
  for (const std::uint64_t tick : {1, 2, 3}) {
    mesh.begin(tick);
    mesh.show(field, {});
    mesh.write(tick - 1, slot);
  }
  EXPECT_EQ(slot.block_ticks[3], 1u);
}

// However many ticks ago it was written: fewer than the mesh remembers, or more.
TEST(ShownMesh, BringsAnySlotUpToDate) {
  for (const std::uint64_t behind : {1, 2, 7, 8, 9, 30}) {
    ShownMesh mesh(few_points());
    DeformedMesh slot = slot_at_rest(mesh), other = slot;
    for (std::uint64_t tick = 1; tick <= behind; ++tick) {
      test::MovedBlocks field(few_points().blocks.size());
      field.move(static_cast<std::uint32_t>(tick % 11), {0.1 * static_cast<double>(tick), 0, 0});
      mesh.begin(tick);
      mesh.show(field, {});
      mesh.write(tick - 1, other);
    }
    mesh.write(0, slot);
    EXPECT_EQ(slot.deformed_vertices, other.deformed_vertices) << behind;
    EXPECT_EQ(slot.block_ticks, other.block_ticks) << behind;
  }
}

TEST(ShownMesh, AMovedBodyMovesEveryPointAndTheMeanSaysBy) {
  ShownMesh mesh(few_points());
  DeformedMesh slot = slot_at_rest(mesh);
  const BodyFrame frame(Mat3::Identity(), {0, 3, 0});
  const test::MovedBlocks still(few_points().blocks.size());
  mesh.begin(1);
  EXPECT_FALSE(mesh.is_in(frame));
  mesh.show(still, frame);
  mesh.write(0, slot);
  EXPECT_TRUE(mesh.is_in(frame));
  EXPECT_EQ(mesh.moved_vertices(), few_points().size());
  EXPECT_NEAR(mesh.mean_displacement().y(), 3, 1e-5);
  EXPECT_NEAR(mesh.max_displacement_mm(), 3, 1e-5);
  for (std::uint32_t b = 0; b < few_points().blocks.size(); ++b) EXPECT_EQ(slot.block_ticks[b], 1u);
}

}  // namespace
}  // namespace brachy
