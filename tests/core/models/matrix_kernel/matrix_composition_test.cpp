// Sub-steps of `elastic` and `fem`, as every tick under the default policy has them.
#include "core/models/matrix_kernel/matrix_composition.h"

#include <gtest/gtest.h>

#include "core/models/guard/guarded_field.h"
#include "tests/core/injectivity/random_scene.h"
#include "tests/core/models/blocks/small_tissue.h"
#include "tests/core/models/deformation_gradient.h"
#include "tests/core/models/matrix_kernel/accurate_models.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

constexpr std::size_t kComposedLandmarks = 40;

const Tissue& composed_phantom() {
  static const Tissue tissue = test::small_phantom(Vec3::Zero());
  return tissue;
}

std::unique_ptr<GuardedField> composed(const char* model_name, int max_substeps = 8) {
  auto field = std::make_unique<MatrixKernelField>(
      composed_phantom(), model_name, ElasticBody{},
      MatrixKernelField::Options{.max_landmarks = kComposedLandmarks, .evaluates_points = false});
  auto composition =
      std::make_unique<MatrixComposition>(composed_phantom(), *field, best_simd_target(), kComposedLandmarks,
                                          static_cast<std::size_t>(max_substeps));
  return std::make_unique<GuardedField>(composed_phantom(), std::move(field), std::move(composition),
                                        GuardSettings{.max_substeps = max_substeps});
}

// A contact whose force is spread over 9 mm.
LandmarkSet press(double d) {
  return LandmarkSet::of(std::vector<Vec3>{{0, 0, -15}}, std::vector<Vec3>{d * Vec3(0.1, 0, 1).normalized()},
                         std::vector<LandmarkSpread>{{.core_mm = 9}});
}

// A shaft of seven and its tip, moved by d.
LandmarkSet shaft(const Vec3& d) {
  std::vector<Vec3> positions;
  for (int k = 0; k < 8; ++k) positions.emplace_back(2, -1, k < 7 ? -16 + 4.0 * k : 10.5);
  std::vector<LandmarkSpread> spreads(8);
  spreads.back() = {.core_mm = 12, .behind = 6};
  return LandmarkSet::of(positions, std::vector<Vec3>(8, d), spreads);
}

std::vector<LandmarkSet> pushes() {
  return {press(2), press(7.5), shaft({0, 0, 1}), shaft({0, 0, 4}), shaft({2, 0, 0}), shaft({4, 3, 1})};
}

class MatrixCompositionOf : public testing::TestWithParam<const char*> {
 protected:
  static GuardedField& field() {
    static std::map<std::string, std::unique_ptr<GuardedField>> fields;
    auto& field = fields[GetParam()];
    if (!field) field = composed(GetParam());
    return *field;
  }
};

TEST_P(MatrixCompositionOf, TissueAtEachLandmarkGoesWhereItDoes) {
  for (const LandmarkSet& push : pushes()) {
    SCOPED_TRACE(push.displacements[0].transpose());
    ASSERT_TRUE(field().update(push));
    EXPECT_EQ(field().certificate().verdict, Verdict::kInjective);
    EXPECT_EQ(field().certificate().held_mm, 0);
    for (std::size_t i = 0; i < push.positions.size(); ++i)
      EXPECT_LT((field().displacement_at(push.positions[i]) - push.displacements[i]).norm(), 5e-3) << i;
  }
}

TEST_P(MatrixCompositionOf, ThePointsOfTheTissueGoWhereTheSingleOnesDo) {
  for (const LandmarkSet& push : pushes()) {
    SCOPED_TRACE(push.displacements[0].transpose());
    ASSERT_TRUE(field().update(push));
    for (const std::uint32_t b : field().touched()) {
      const Block& block = composed_phantom().blocks[b];
      const BlockDisplacement<float>& u = field().displacement(b);
      for (std::uint32_t i = 0; i < block.count; i += 5)
        ASSERT_LT((Vec3(u.ux[i], u.uy[i], u.uz[i]) -
                   field().displacement_at(composed_phantom().rest_vertices[block.first + i]))
                      .norm(),
                  0.01);
    }
  }
}

// Beside the needle by three radii and more: nearer its rings are the needle itself.
TEST_P(MatrixCompositionOf, DeterminantsAreAboveTheirBoundAndTheLeastAtAVertexIsFound) {
  for (const LandmarkSet& push : pushes()) {
    SCOPED_TRACE(push.displacements[0].transpose());
    ASSERT_TRUE(field().update(push));
    const Certificate& c = field().certificate();
    ASSERT_EQ(c.verdict, Verdict::kInjective);
    // The axis of the shaft's rings, whose ends lie 0.3 radii inward.
    constexpr double kRadius = 0.635;
    const auto is_beside = [&](const Vec3& X) {
      const Vec3 nearest(2, -1, std::clamp(X.z(), -16 + 0.3 * kRadius, 10.5 - 0.3 * kRadius));
      return push.positions.size() == 1 || (X - nearest).norm() > 3 * kRadius;
    };
    double least = 1;
    for (std::size_t i = 0; i < composed_phantom().size(); ++i)
      if (const Vec3& X = composed_phantom().rest_vertices[i]; is_beside(X))
        least = std::min(least, test::deformation_gradient(field(), X).determinant());
    EXPECT_GT(least, c.det_bound);
    EXPECT_NEAR(c.vertex_det, least, 0.03);
    test::RandomScenes random(3);
    for (int i = 0; i < 200; ++i) {
      const Vec3 X = random.between(0, 18) * random.direction();
      if (is_beside(X)) {
        EXPECT_GT(test::deformation_gradient(field(), X).determinant(), c.det_bound) << X.transpose();
      }
    }
  }
}

TEST_P(MatrixCompositionOf, WhatIsShownDependsOnThePresentLandmarksOnly) {
  const auto fresh = composed(GetParam());
  const LandmarkSet other = shaft({3, 1, 2}), push = shaft({4, 3, 1});
  ASSERT_TRUE(field().update(other));
  const std::uint64_t before = test::allocation_count();
  ASSERT_TRUE(field().update(push));
  EXPECT_EQ(test::allocation_count(), before);
  ASSERT_TRUE(fresh->update(push));
  for (const std::uint32_t b : fresh->touched())
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) {
      ASSERT_EQ(field().displacement(b).ux[i], fresh->displacement(b).ux[i]);
      ASSERT_EQ(field().displacement(b).uz[i], fresh->displacement(b).uz[i]);
    }
  ASSERT_TRUE(field().update(LandmarkSet::of({})));
  EXPECT_TRUE(field().touched().empty());
}

// From one step to two the last one begins with nothing, so that a push that grows moves nothing at once.
TEST_P(MatrixCompositionOf, AnotherStepComesWithoutAJump) {
  const Vec3 X(6, 1, 2);
  Vec3 last = Vec3::Zero();
  std::uint32_t steps = 0, changes = 0;
  for (double d = 0.5; d < 5; d += 0.01) {
    const LandmarkSet push = shaft({0.8 * d, 0, 0.6 * d});
    ASSERT_TRUE(field().update(push));
    const Vec3 u = field().displacement_at(X);
    if (d > 0.505) {
      EXPECT_LT((u - last).norm(), 0.02) << d;
    }
    last = u;
    changes += field().certificate().substeps != std::exchange(steps, field().certificate().substeps);
  }
  EXPECT_GT(changes, 1u);
}

TEST_P(MatrixCompositionOf, WhereStepsEndLandmarksAreClampedAndFlagged) {
  const auto two = composed(GetParam(), 2);
  const LandmarkSet push = shaft({8, 0, 0});
  ASSERT_TRUE(two->update(push));
  const Certificate& c = two->certificate();
  EXPECT_NE(c.verdict, Verdict::kFolded);
  EXPECT_GT(c.held_mm, 0);
  EXPECT_LE(c.substeps, 2u);
  EXPECT_GT(two->displacement_at(push.positions[3]).x(), 0.4 * (8 - c.held_mm));
}

INSTANTIATE_TEST_SUITE_P(Models, MatrixCompositionOf, testing::ValuesIn(test::accurate_models()),
                         [](const auto& model_name) { return model_name.param; });

}  // namespace
}  // namespace brachy
