#include "core/models/blocks/block_field.h"

#include <gtest/gtest.h>

#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"
#include "tests/core/models/blocks/small_tissue.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

using test::displacements_of;
using test::small_phantom;
using test::supported_targets;

TEST(BlockField, VisitsOnlyBlocksWithinReach) {
  const Tissue tissue = small_phantom(Vec3::Zero());
  BlockField field(tissue, Wendland31{}, 6, {});
  const std::vector<Vec3> p{{22, 0, 0}}, w{{1, 0, 0}};
  field.set_landmarks(p);
  field.evaluate(w);
  EXPECT_GT(field.touched().size(), 0u);
  EXPECT_LT(field.touched().size(), tissue.blocks.size() / 2);
  EXPECT_TRUE(std::ranges::is_sorted(field.touched()));
  EXPECT_LE(field.statistics().pairs, 64 * field.touched().size());
  EXPECT_GE(field.statistics().pairs, 16 * field.touched().size());
  field.set_landmarks({});
  field.evaluate({});
  EXPECT_TRUE(field.touched().empty());
  EXPECT_EQ(field.statistics().pairs, 0u);
}

TEST(BlockField, PointsWithLargeWeightsAreSummedInDouble) {
  const Tissue tissue = small_phantom(Vec3::Zero());
  BlockField field(tissue, Wendland31{}, 12, {});
  // Two very close landmarks that almost cancel: 3000 mm of weight, a few mm of field.
  const std::vector<Vec3> p{{0, 0, 0}, {0.01, 0, 0}}, w{{3000, 0, 0}, {-3000, 0, 0}};
  field.set_landmarks(p);
  field.evaluate(w);
  EXPECT_GT(field.statistics().double_groups, 0u);
  const RbfField plain{Wendland31{}, 12, p, w};
  const auto u = displacements_of(field, tissue);
  for (std::size_t i = 0; i < tissue.size(); ++i)
    ASSERT_LT((u[i] - plain.displacement(tissue.rest_vertices[i])).norm(), BlockField::kFloatError);
}

TEST(BlockField, IsTheSameForAnyNumberOfThreads) {
  Scene scene;
  scene.tissue.points = 200'000;  // enough work for threads to be used
  const Tissue tissue = load_tissue(scene).tissue;
  std::mt19937_64 random(3);
  const auto L = test::random_landmarks(random, 60, 20, 3, 5);
  std::vector<std::vector<Vec3>> results;
  for (int threads : {1, 2, 3}) {
    BlockField field(tissue, Wendland31{}, 40, {.threads = threads});
    field.set_landmarks(L.positions);
    field.evaluate(L.displacements);
    results.push_back(displacements_of(field, tissue));
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST(BlockField, ManyLandmarksGiveTheSameField) {
  const Tissue tissue = small_phantom(Vec3::Zero());
  std::mt19937_64 random(4);
  const auto L = test::random_landmarks(random, 600, 20, 1, 0.01);
  BlockField field(tissue, Wendland31{}, 40, {.max_landmarks = 600});
  field.set_landmarks(L.positions);
  field.evaluate(L.displacements);
  const RbfField plain{Wendland31{}, 40, L.positions, L.displacements};
  const auto u = displacements_of(field, tissue);
  for (std::size_t i = 0; i < tissue.size(); i += 7)
    ASSERT_LT((u[i] - plain.displacement(tissue.rest_vertices[i])).norm(), BlockField::kFloatError);
}

TEST(SimdTarget, NamesAreFoundAndTheBestOneIsSupported) {
  EXPECT_TRUE(is_supported(best_simd_target()));
  for (SimdTarget target : supported_targets()) EXPECT_EQ(find_simd_target(to_string(target)), target);
  EXPECT_FALSE(find_simd_target("mmx"));
  EXPECT_EQ(resolve_simd_target("auto"), best_simd_target());
  EXPECT_EQ(resolve_simd_target("generic"), SimdTarget::kGeneric);
}

}  // namespace
}  // namespace brachy
