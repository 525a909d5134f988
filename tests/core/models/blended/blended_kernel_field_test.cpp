#include "core/models/blended/blended_kernel_field.h"

#include <gtest/gtest.h>

#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/scalar_kernel/scalar_kernel_field.h"
#include "tests/core/models/blended/random_tissues.h"
#include "tests/core/models/blocks/reactions.h"
#include "tests/core/models/blocks/small_tissue.h"

namespace brachy {
namespace {

using test::sphere;

const Tissue& phantom() {
  static const Tissue tissue = test::small_phantom(Vec3::Zero());
  return tissue;
}

std::vector<Vec3> displacements_of(const TissueField& field) {
  std::vector<Vec3> u(phantom().size(), Vec3::Zero());
  for (const std::uint32_t b : field.touched()) {
    const Block& block = phantom().blocks[b];
    const BlockDisplacement<float>& d = field.displacement(b);
    for (std::uint32_t i = 0; i < block.count; ++i) u[block.first + i] = Vec3(d.ux[i], d.uy[i], d.uz[i]);
  }
  return u;
}

double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, (a[i] - b[i]).norm());
  return worst;
}

// Against the exact field at every point.
double error_of(const TissueField& field) {
  std::vector<Vec3> exact;
  for (const Vec3& X : phantom().rest_vertices) exact.push_back(field.displacement_at(X));
  return largest_difference(displacements_of(field), exact);
}

std::vector<Membership::Part> tumour_in_a_lobe() {
  return {{std::make_shared<EllipsoidDistance>(Vec3(6, 0, 0), Vec3(15, 14, 16)), 5, 1},
          {sphere({8, -4, 3}, 6), 4, 2}};
}

TissueModel<ScalarKernels> scalar_model(const Kernel& psi) {
  return {{tumour_in_a_lobe(), 3}, {psi, {8, 14, 30}}};
}

TissueModel<CompactKernels> nested_lobe_model() {
  ElasticBody body;
  CompactKernels kernels;
  for (const double wall : {48.0, 30.0, 12.0}) {
    body.box_size.setConstant(2 * wall);
    kernels.kernels.push_back(CompactKernel::of_body(body));
  }
  return {{tumour_in_a_lobe(), 3}, std::move(kernels)};
}

struct Needle {
  std::vector<Vec3> positions, displacements;
};

// A shaft through all three tissues, dragged along and aside, its tip last.
Needle shaft() {
  Needle needle;
  for (int k = 0; k <= 9; ++k) {
    needle.positions.push_back(Vec3(8, -4, -20) + 4.0 * k * Vec3(0.05, 0.02, 0.998));
    needle.displacements.push_back(Vec3(0.2, 0.1 * k, 1.2));
  }
  return needle;
}

TEST(BlendedKernelField, PointsGoWhereTheExactFieldTakesThem) {
  std::mt19937_64 random(3);
  for (const Kernel& psi :
       {Kernel(Wendland30{}), Kernel(Wendland31{}), Kernel(Wendland32{}), Kernel(Buhmann{})})
    for (const SimdTarget target : test::supported_targets()) {
      BlendedKernelField field(phantom(), scalar_model(psi), {.target = target});
      const Needle needle = shaft();
      ASSERT_TRUE(field.update(LandmarkSet::of(needle.positions, needle.displacements)));
      EXPECT_EQ(field.evaluation(), Evaluation::kDirect);
      EXPECT_LT(error_of(field), 2e-5) << name_of(psi) << " " << to_string(target);
      const auto set = test::random_landmarks(random, 40, 22, 3, 5);
      ASSERT_TRUE(field.update(LandmarkSet::of(set.positions, set.displacements)));
      EXPECT_LT(error_of(field), 2e-5) << name_of(psi) << " " << to_string(target);
    }
}

TEST(BlendedKernelField, CompactElasticDoesSoToo) {
  for (const SimdTarget target : test::supported_targets()) {
    BlendedKernelField field(phantom(), nested_lobe_model(), {.target = target});
    const Needle needle = shaft();
    ASSERT_TRUE(field.update(LandmarkSet::of(needle.positions, needle.displacements)));
    EXPECT_LT(error_of(field), 2e-5) << to_string(target);
  }
}

TEST(BlendedKernelField, OneSupportEverywhereIsTheHomogeneousTick) {
  const std::vector<Membership::Part> parts = {{sphere({6, 0, 0}, 12), 5, 0}};
  const Needle needle = shaft();
  BlendedKernelField<ScalarKernels> field(phantom(), {{parts, 1}, {Wendland31{}, {14}}}, {});
  ScalarKernelField plain(phantom(), Wendland31{}, 14, {});
  ASSERT_TRUE(field.update(LandmarkSet::of(needle.positions, needle.displacements)));
  ASSERT_TRUE(plain.update(LandmarkSet::of(needle.positions, needle.displacements)));
  EXPECT_LT(largest_difference(displacements_of(field), displacements_of(plain)), 2e-5);

  const CompactKernel kernel = CompactKernel::of_body({});
  BlendedKernelField<CompactKernels> compact(phantom(), {{parts, 1}, {{kernel}}}, {});
  MatrixKernelField homogeneous(phantom(), "compact_elastic", {}, {});
  ASSERT_TRUE(compact.update(LandmarkSet::of(needle.positions, needle.displacements)));
  ASSERT_TRUE(homogeneous.update(LandmarkSet::of(needle.positions, needle.displacements)));
  EXPECT_LT(largest_difference(displacements_of(compact), displacements_of(homogeneous)), 2e-5);
}

TEST(BlendedKernelField, OnlyBlocksInReachAreTouchedAndInOrder) {
  BlendedKernelField field(phantom(), scalar_model(Wendland31{}), {});
  ASSERT_TRUE(field.update(LandmarkSet::of(std::vector<Vec3>{{-20, 0, 0}}, std::vector<Vec3>{{1, 0, 0}})));
  EXPECT_FALSE(field.touched().empty());
  EXPECT_LT(field.touched().size(), phantom().blocks.size() / 2);
  EXPECT_TRUE(std::ranges::is_sorted(field.touched()));
  const auto u = displacements_of(field);
  for (std::size_t i = 0; i < u.size(); ++i) {
    const Vec3& X = phantom().rest_vertices[i];
    if ((X - Vec3(-20, 0, 0)).norm() > 8 || (X - Vec3(8, -4, 3)).norm() < 4) {
      ASSERT_EQ(u[i], Vec3(0, 0, 0));
    }
  }
  ASSERT_TRUE(field.update(LandmarkSet::of({})));
  EXPECT_TRUE(field.touched().empty());
  EXPECT_EQ(field.displacement_at({8, -4, 3}), Vec3(0, 0, 0));
}

TEST(BlendedKernelField, ARegionBesideTheTissueMovesNothing) {
  const std::vector<Membership::Part> parts = {{sphere({90, 0, 0}, 12), 5, 1}};
  BlendedKernelField<ScalarKernels> field(phantom(), {{parts, 2}, {Wendland31{}, {14, 40}}}, {});
  const Needle needle = shaft();
  ASSERT_TRUE(field.update(LandmarkSet::of(needle.positions, needle.displacements)));
  EXPECT_LT(error_of(field), 2e-5);
  ASSERT_TRUE(field.update(LandmarkSet::of(std::vector<Vec3>{{90, 0, 0}}, std::vector<Vec3>{{1, 0, 0}})));
  EXPECT_TRUE(field.touched().empty());
}

template <class Model>
void expect_bits_without_history(const Model& model) {
  const Needle needle = shaft();
  const LandmarkSet landmarks = LandmarkSet::of(needle.positions, needle.displacements);
  BlendedKernelField a(phantom(), model, {}), b(phantom(), model, {.threads = 2});
  for (std::size_t n = 1; n < needle.positions.size(); ++n)
    ASSERT_TRUE(a.update(
        LandmarkSet::of(std::span(needle.positions).first(n), std::span(needle.displacements).first(n))));
  auto moved = needle.positions;
  moved[3] += Vec3(0, 0, 0.3);
  ASSERT_TRUE(a.update(LandmarkSet::of(moved, needle.displacements)));
  ASSERT_TRUE(a.update(landmarks));
  ASSERT_TRUE(b.update(landmarks));
  EXPECT_TRUE(std::ranges::equal(a.touched(), b.touched()));
  EXPECT_EQ(displacements_of(a), displacements_of(b));
  ASSERT_TRUE(a.update(landmarks));
  EXPECT_EQ(a.evaluation(), Evaluation::kIdle);
}

TEST(BlendedKernelField, TheSameTickInAnyHistoryGivesTheSameBits) {
  expect_bits_without_history(scalar_model(Wendland31{}));
  expect_bits_without_history(nested_lobe_model());
}

TEST(BlendedKernelField, ARefusedSetKeepsTheLastFieldAndTheNextOneIsSolved) {
  BlendedKernelField field(phantom(), scalar_model(Wendland31{}), {});
  const Needle needle = shaft();
  ASSERT_TRUE(field.update(LandmarkSet::of(needle.positions, needle.displacements)));
  const auto before = displacements_of(field);
  const Vec3 u = field.displacement_at({8, -3, 1});
  auto doubled = needle.positions;
  doubled[3] = doubled[2];
  EXPECT_EQ(field.update(LandmarkSet::of(doubled, needle.displacements)).kind, FactorStatus::kDuplicate);
  EXPECT_EQ(displacements_of(field), before);
  EXPECT_EQ(field.displacement_at({8, -3, 1}), u);
  ASSERT_TRUE(field.update(LandmarkSet::of(needle.positions, needle.displacements)));
  EXPECT_EQ(displacements_of(field), before);
}

template <class Model>
void expect_reactions(const Model& model) {
  std::mt19937_64 random(21);
  BlendedKernelField field(phantom(), model, {}, 0.4), fresh(phantom(), model, {}, 0.4);
  const std::vector<Vec3> d = {{1, -2, 0.5}};
  std::vector<Vec3> f(1);
  ASSERT_TRUE(field.factorize(LandmarkSet::of(std::vector<Vec3>{{-18, 0, 0}})));  // in no region
  field.solve(d, f);
  EXPECT_LT((f[0] - 0.4 * d[0]).norm(), 1e-12);
  const auto now = test::random_landmarks(random, 12, 10, 3, 3),
             next = test::random_landmarks(random, 30, 18, 3, 3);
  test::expect_axial_stiffness(field, next.positions, {}, 0);
  test::expect_axial_stiffness(field, next.positions, {}, 11);
  test::expect_axial_stiffness(field, shaft().positions, {}, 3);
  test::expect_factorize_leaves_the_field(field, fresh, now, next);
}

TEST(BlendedKernelField, ReactionsAreForcesInUnitsOfTheBasesLoneLandmark) {
  expect_reactions(scalar_model(Wendland31{}));
  expect_reactions(scalar_model(Buhmann{}));
  expect_reactions(nested_lobe_model());
}

}  // namespace
}  // namespace brachy
