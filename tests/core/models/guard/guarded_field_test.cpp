#include "core/models/guard/guarded_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/models/scalar_kernel/scalar_composition.h"
#include "core/models/scalar_kernel/scalar_kernel_field.h"
#include "core/simulation/mesh_state.h"
#include "tests/core/injectivity/random_scene.h"
#include "tests/core/models/blocks/reactions.h"
#include "tests/core/models/blocks/small_tissue.h"
#include "tests/core/models/deformation_gradient.h"

namespace brachy {
namespace {

constexpr std::size_t kLandmarks = 40;

std::unique_ptr<GuardedField> guarded(const Tissue& tissue, const Kernel& kernel, double support,
                                      const std::string& policy, int max_substeps = 8) {
  const SimdTarget target = best_simd_target();
  return std::make_unique<GuardedField>(
      tissue,
      std::make_unique<ScalarKernelField>(tissue, kernel, support,
                                          BlockField::Options{.target = target, .max_landmarks = kLandmarks}),
      std::make_unique<ScalarComposition>(tissue, kernel, support, target, kLandmarks,
                                          static_cast<std::size_t>(max_substeps)),
      GuardSettings{.policy = policy, .max_substeps = max_substeps});
}

double determinant_at(const GuardedField& field, const Vec3& X) {
  return test::deformation_gradient(field, X).determinant();
}

// A contact on the phantom's axis, or a shaft of six, pushed by `d` mm along z; anchors 20 mm aside.
LandmarkSet push(bool is_shaft, double d) {
  std::vector<Vec3> positions{{20, 0, 0}, {-20, 3, 0}}, displacements(2, Vec3::Zero());
  for (int i = 0; i < (is_shaft ? 6 : 1); ++i) {
    positions.emplace_back(0, 0, -5.0 * (is_shaft ? 5 - i : 0));
    displacements.emplace_back(0.1 * d, 0, d);
  }
  return LandmarkSet::of(positions, displacements);
}

TEST(GuardedField, SubstepsStayInjectiveToFifteenMillimetresWhereThePlainFieldFolds) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  for_each_kernel([&](auto kernel) {
    SCOPED_TRACE(kernel.kName);
    const auto plain = guarded(tissue, kernel, 12, "flag"), composed = guarded(tissue, kernel, 12, "substep");
    for (const bool is_shaft : {false, true})
      for (const double d : {4.0, 8.0, 15.0}) {
        SCOPED_TRACE(d);
        const LandmarkSet p = push(is_shaft, d);
        ASSERT_TRUE(plain->update(p));
        ASSERT_TRUE(composed->update(p));
        EXPECT_EQ(plain->certificate().verdict == Verdict::kFolded, d > 6);
        EXPECT_EQ(composed->certificate().verdict, Verdict::kInjective);
        EXPECT_EQ(composed->certificate().held_mm, 0);
        EXPECT_EQ((composed->flags() & kStepSubstepped) != 0, composed->certificate().substeps > 1);
        if (d > 6) {
          EXPECT_GT(composed->certificate().substeps, 1u);
        }
        EXPECT_GT(composed->certificate().vertex_det, 0);
        EXPECT_GE(composed->certificate().vertex_det, composed->certificate().det_bound);
        for (std::size_t i = 0; i < p.positions.size(); ++i)
          EXPECT_LT((composed->displacement_at(p.positions[i]) - p.displacements[i]).norm(), 1e-6);
        test::RandomScenes random(3);
        for (int i = 0; i < 300; ++i) {
          const Vec3 X = random.between(0, 20) * random.direction() + Vec3(0, 0, 3);
          EXPECT_GT(determinant_at(*composed, X), 0) << X.transpose();
        }
      }
  });
}

TEST(GuardedField, ThePointsOfTheTissueGoWhereTheSingleOnesDo) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const auto field = guarded(tissue, Wendland31{}, 12, "substep");
  const LandmarkSet p = push(true, 12);
  ASSERT_TRUE(field->update(p));
  ASSERT_GT(field->certificate().substeps, 1u);
  std::vector<Vec3> u(tissue.size(), Vec3::Zero());
  double least = 1;
  for (const std::uint32_t b : field->touched()) {
    const Block& block = tissue.blocks[b];
    const BlockDisplacement<float>& d = field->displacement(b);
    for (std::uint32_t i = 0; i < block.count; ++i) u[block.first + i] = Vec3(d.ux[i], d.uy[i], d.uz[i]);
  }
  for (std::size_t i = 0; i < tissue.size(); ++i) {
    EXPECT_LT((u[i] - field->displacement_at(tissue.rest_vertices[i])).norm(), 5e-5);
    least = std::min(least, determinant_at(*field, tissue.rest_vertices[i]));
  }
  EXPECT_NEAR(field->certificate().vertex_det, least, 1e-3);
}

TEST(GuardedField, WhatIsShownDependsOnThePresentLandmarksOnly) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const auto field = guarded(tissue, Wendland31{}, 12, "substep"),
             fresh = guarded(tissue, Wendland31{}, 12, "substep");
  for (const double d : {2.0, 9.0, 15.0, 4.0}) {
    const LandmarkSet p = push(true, d);
    ASSERT_TRUE(field->update(p));
  }
  const LandmarkSet p = push(true, 9);
  ASSERT_TRUE(field->update(p));
  ASSERT_TRUE(fresh->update(p));
  for (std::size_t i = 0; i < tissue.size(); i += 7)
    EXPECT_EQ(field->displacement_at(tissue.rest_vertices[i]),
              fresh->displacement_at(tissue.rest_vertices[i]));
  EXPECT_EQ(field->certificate().substeps, fresh->certificate().substeps);
  ASSERT_TRUE(field->update(LandmarkSet::of({})));
  EXPECT_TRUE(field->touched().empty());
  EXPECT_EQ(field->certificate().substeps, 0u);
}

TEST(GuardedField, ClampHoldsLandmarksAtTheLastInjectivePosition) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const auto field = guarded(tissue, Wendland31{}, 12, "clamp");
  const LandmarkSet p = push(false, 10);
  ASSERT_TRUE(field->update(p));
  const Certificate& c = field->certificate();
  EXPECT_EQ(c.verdict, Verdict::kInjective);
  EXPECT_TRUE(field->flags() & kStepClamped);
  const double shown = field->displacement_at(p.positions.back()).norm();
  EXPECT_NEAR(shown + c.held_mm, p.displacements.back().norm(), 1e-9);
  EXPECT_LT(shown, 12 / Wendland31::kMaxSlope);
  EXPECT_GT(shown, 0.85 * 12 / Wendland31::kMaxSlope);
  EXPECT_GT(determinant_at(*field, p.positions.back() + Vec3(0, 0, 3)), 0);
  // The clamped part in both units: a kernel's weights are forces for a lone landmark of 1 N/mm.
  EXPECT_NEAR(c.held_n, c.held_mm, 0.2 * c.held_mm);
}

TEST(GuardedField, BeyondTheLastSubstepLandmarksAreHeld) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const auto field = guarded(tissue, Wendland31{}, 12, "substep", 2);
  const LandmarkSet p = push(false, 15);
  ASSERT_TRUE(field->update(p));
  EXPECT_EQ(field->certificate().substeps, 2u);
  EXPECT_EQ(field->flags(), kStepSubstepped | kStepClamped);
  EXPECT_NEAR(field->displacement_at(p.positions.back()).norm() + field->certificate().held_mm,
              p.displacements.back().norm(), 1e-9);
}

// The reported remaining displacement can be applied.
TEST(GuardedField, TheMarginIsInjectiveToo) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const auto field = guarded(tissue, Wendland31{}, 12, "flag");
  for (const double d : {1.0, 3.0, 5.0}) {
    LandmarkSet p = push(false, d);
    ASSERT_TRUE(field->update(p));
    const double margin = field->certificate().margin_mm, length = p.displacements.back().norm();
    EXPECT_GT(margin, 0.1);
    EXPECT_LT(length + margin, 12 / Wendland31::kMaxSlope);
    for (Vec3& way : p.displacements) way *= 1 + margin / length;
    p.settle();
    ASSERT_TRUE(field->update(p));
    EXPECT_EQ(field->certificate().verdict, Verdict::kInjective);
  }
}

TEST(GuardedField, ReactionsAreThoseOfThePlacedLandmarksWhateverIsShown) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const auto field = guarded(tissue, Wendland31{}, 12, "substep");
  const LandmarkSet shown = push(true, 12), other = push(true, 2);
  ASSERT_TRUE(field->update(shown));
  ASSERT_GT(field->certificate().substeps, 1u);
  const Vec3 u = field->displacement_at({1, 2, 3});
  std::vector<Vec3> more = other.positions, f(shown.positions.size()), again(f.size());
  field->plain_field().solve(shown.displacements, f);
  more.emplace_back(9, 0, 0);
  test::expect_axial_stiffness(field->plain_field(), more, {}, 2);
  EXPECT_EQ(field->displacement_at({1, 2, 3}), u);
  // Repeating the update changes nothing, but its landmarks are then the factorized ones.
  ASSERT_TRUE(field->update(shown));
  EXPECT_EQ(field->evaluation(), Evaluation::kIdle);
  EXPECT_EQ(field->displacement_at({1, 2, 3}), u);
  field->plain_field().solve(shown.displacements, again);
  for (std::size_t i = 0; i < f.size(); ++i) EXPECT_LT((again[i] - f[i]).norm(), 1e-9);
}

TEST(GuardedField, ShowsLandmarksThatRestAndNoOthers) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const auto field = guarded(tissue, Wendland31{}, 12, "substep");
  LandmarkSet p = push(true, 3);
  EXPECT_FALSE(field->shows(p));
  ASSERT_TRUE(field->update(p));
  EXPECT_TRUE(field->shows(p));
  const auto settle_at = [&](double moved_mm) {
    p.displacements[3] += Vec3(moved_mm, 0, 0);
    p.settle();
  };
  settle_at(0.5 * LandmarkSet::kRestToleranceMm);
  EXPECT_TRUE(field->shows(p));
  ASSERT_TRUE(field->update(p));
  EXPECT_EQ(field->evaluation(), Evaluation::kIdle);
  settle_at(LandmarkSet::kRestToleranceMm);
  EXPECT_FALSE(field->shows(p));
  ASSERT_TRUE(field->update(p));
  EXPECT_NE(field->evaluation(), Evaluation::kIdle);
  // Of other spreads it is another field, whether the model uses them or not.
  p.spreads[3].core_mm = 2;
  p.number();
  p.settle();
  EXPECT_FALSE(field->shows(p));
}

TEST(GuardedField, ADisplacementThatIsNotFiniteIsRefusedAndTheLastFieldStands) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const auto field = guarded(tissue, Wendland31{}, 12, "substep");
  LandmarkSet p = push(true, 3);
  ASSERT_TRUE(field->update(p));
  const Vec3 before = field->displacement_at({1, 2, 3});
  p.displacements[3].y() = std::numeric_limits<double>::quiet_NaN();
  p.settle();
  EXPECT_EQ(field->update(p).kind, FactorStatus::kNotFinite);
  EXPECT_EQ(field->displacement_at({1, 2, 3}), before);
}

}  // namespace
}  // namespace brachy
