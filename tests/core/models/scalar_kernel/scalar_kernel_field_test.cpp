#include "core/models/scalar_kernel/scalar_kernel_field.h"

#include <gtest/gtest.h>

#include "core/base/work_budget.h"
#include "tests/core/models/blocks/reactions.h"
#include "tests/core/models/blocks/small_tissue.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

using test::displacements_of;

struct DeformationWays : ::testing::Test {
  DeformationWays() {
    std::mt19937_64 random(5);
    auto L = test::random_landmarks(random, 20, 18, 4, 3);
    positions = L.positions;
    displacements = L.displacements;
    for (std::size_t j = 4; j < displacements.size(); ++j) displacements[j] = Vec3::Zero();
    landmarks.reserve(positions.size());
  }
  void nudge(int tick) { displacements[static_cast<std::size_t>(tick % 4)].x() += 0.01; }
  FactorStatus update() {
    landmarks.assign(positions, displacements);
    return deformation.update(landmarks);
  }
  std::vector<Vec3> fresh() const {
    ScalarKernelField direct(tissue, Wendland31{}, 20, {});
    EXPECT_TRUE(direct.update(LandmarkSet::of(positions, displacements)));
    return displacements_of(direct.blocks(), tissue);
  }

  const Tissue tissue = test::small_phantom(Vec3::Zero());
  std::vector<Vec3> positions, displacements;
  LandmarkSet landmarks;
  ScalarKernelField deformation{tissue, Wendland31{}, 20, {}};
};

TEST_F(DeformationWays, NothingNewIsIdle) {
  ASSERT_TRUE(update());
  EXPECT_EQ(deformation.evaluation(), Evaluation::kDirect);
  ASSERT_TRUE(update());
  EXPECT_EQ(deformation.evaluation(), Evaluation::kIdle);
}

TEST_F(DeformationWays, LandmarksThatStayAreCondensedWithoutChangingTheResult) {
  bool was_mixed = false;
  int tick = 0;
  for (; tick < 200 && deformation.evaluation() != Evaluation::kCondensed; ++tick) {
    nudge(tick);
    ASSERT_TRUE(update());
    was_mixed |= deformation.evaluation() == Evaluation::kMixed;
    const auto expected = fresh(), u = displacements_of(deformation.blocks(), tissue);
    for (std::size_t i = 0; i < tissue.size(); ++i) ASSERT_LT((u[i] - expected[i]).norm(), 2e-5) << tick;
  }
  EXPECT_EQ(deformation.evaluation(), Evaluation::kCondensed);
  EXPECT_TRUE(was_mixed);  // it was spread over ticks
  EXPECT_GT(tick, SpeedThresholds::kSettleTicks);
  EXPECT_EQ(deformation.blocks().statistics().pairs, 0u);
}

TEST_F(DeformationWays, ANewLandmarkOrAnotherMovingOneStartsOverDirectly) {
  for (int tick = 0; tick < 200 && deformation.evaluation() != Evaluation::kCondensed; ++tick) {
    nudge(tick);
    ASSERT_TRUE(update());
  }
  ASSERT_EQ(deformation.evaluation(), Evaluation::kCondensed);
  displacements[10] = Vec3(1, 0, 0);
  ASSERT_TRUE(update());
  EXPECT_EQ(deformation.evaluation(), Evaluation::kDirect);
  EXPECT_EQ(displacements_of(deformation.blocks(), tissue), fresh());

  positions.push_back({23, 0, 0});
  displacements.push_back({0, 0.5, 0});
  ASSERT_TRUE(update());
  EXPECT_EQ(deformation.evaluation(), Evaluation::kDirect);
  EXPECT_EQ(displacements_of(deformation.blocks(), tissue), fresh());
}

TEST_F(DeformationWays, ATipThatMovesGivesTheFieldOfAFreshStart) {
  for (int tick = 0; tick < 30; ++tick) {
    positions.back() += Vec3(0.01, 0.02, -0.03);
    nudge(tick);
    if (tick == 10) {  // the cut path grows before the tip
      positions.insert(positions.end() - 1, Vec3(23, 0, 0));
      displacements.insert(displacements.end() - 1, Vec3(0, 0.5, 0));
    }
    if (tick == 20) {
      positions.erase(positions.end() - 2);
      displacements.erase(displacements.end() - 2);
    }
    ASSERT_TRUE(update());
    ASSERT_EQ(displacements_of(deformation.blocks(), tissue), fresh()) << tick;
  }
}

TEST_F(DeformationWays, ARefusedSetKeepsTheLastFieldAndTheNextOneIsSolved) {
  ASSERT_TRUE(update());
  const auto before = displacements_of(deformation.blocks(), tissue);
  const Vec3 u = deformation.field().displacement({1, 2, 3});
  auto doubled = positions;
  doubled[3] = doubled[2];
  landmarks.assign(doubled, displacements);
  EXPECT_EQ(deformation.update(landmarks).kind, FactorStatus::kDuplicate);
  EXPECT_EQ(displacements_of(deformation.blocks(), tissue), before);
  EXPECT_EQ(deformation.field().displacement({1, 2, 3}), u);
  nudge(0);
  ASSERT_TRUE(update());
  EXPECT_EQ(displacements_of(deformation.blocks(), tissue), fresh());
}

TEST_F(DeformationWays, NoWayAllocates) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "a sanitizer owns malloc";
  const std::uint64_t before = test::allocation_count();
  for (int tick = 0; tick < 100; ++tick) {
    nudge(tick);
    ASSERT_TRUE(update());
  }
  EXPECT_EQ(deformation.evaluation(), Evaluation::kCondensed);
  EXPECT_EQ(test::allocation_count() - before, 0u);
}

TEST(Reactions, OfALoneLandmarkAreItsStiffness) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  for_each_kernel([&](auto kernel) {
    ScalarKernelField field(tissue, kernel, 12, {}, 0.3);
    ASSERT_TRUE(field.factorize(LandmarkSet::of(std::vector<Vec3>{{1, 2, 3}})));
    const std::vector<Vec3> d = {{1, -2, 0.5}};
    std::vector<Vec3> f(1);
    field.solve(d, f);
    EXPECT_LT((f[0] - 0.3 * d[0]).norm(), 1e-15) << kernel.kName;
    ASSERT_TRUE(field.update(
        LandmarkSet::of(std::vector<Vec3>{{1, 2, 3}}, d, std::vector<LandmarkSpread>{{.core_mm = 5}})));
    EXPECT_NEAR(field.total_force_n(), 0.3 * d[0].norm(), 1e-15);
  });
}

TEST(Reactions, AreThoseOfTheWholeMatrix) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  std::mt19937_64 random(11);
  const auto L = test::random_landmarks(random, 60, 18, 3, 3);
  const auto n = static_cast<Eigen::Index>(L.positions.size());
  ScalarKernelField field(tissue, Wendland31{}, 14, {}, 0.25);
  ASSERT_TRUE(field.factorize(LandmarkSet::of(L.positions)));
  std::vector<Vec3> f(L.positions.size());
  field.solve(L.displacements, f);
  Eigen::MatrixXd K(n, n), d(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    d.row(i) = L.displacements[at];
    for (Eigen::Index j = 0; j < n; ++j)
      K(i, j) = Wendland31::value((L.positions[at] - L.positions[static_cast<std::size_t>(j)]).norm() / 14);
  }
  const Eigen::MatrixXd expected = 0.25 * K.inverse() * d;
  for (Eigen::Index i = 0; i < n; ++i)
    EXPECT_LT((f[static_cast<std::size_t>(i)].transpose() - expected.row(i)).norm(), 1e-10);
}

TEST(Reactions, AxialStiffnessIsTheInversesBlockWithAnchorsFirst) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  std::mt19937_64 random(12);
  for_each_kernel([&](auto kernel) {
    for (const SimdTarget target : test::supported_targets())
      for (const int n : {1, 2, 7, 50, 120}) {
        SCOPED_TRACE(std::string(kernel.kName) + " " + std::string(to_string(target)));
        const auto L = test::random_landmarks(random, n, 20, 2, 3);
        ScalarKernelField field(tissue, kernel, 14, {.target = target, .max_landmarks = 120}, 0.7);
        for (const int first : {0, n / 2})
          test::expect_axial_stiffness(field, L.positions, {}, static_cast<std::size_t>(first));
      }
  });
}

TEST(Reactions, AreRightInASparseFactorToo) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  std::mt19937_64 random(13);
  const auto L = test::random_landmarks(random, 300, 30, 3, 3);
  RbfSystem system(Wendland31{}, 8, 300);
  ASSERT_TRUE(system.factorize(L.positions));
  ASSERT_TRUE(system.is_sparse());  // or this test is void
  ScalarKernelField field(tissue, Wendland31{}, 8, {.max_landmarks = 300}, 2);
  test::expect_axial_stiffness(field, L.positions, {}, 0);
  test::expect_axial_stiffness(field, L.positions, {}, 210);
}

TEST(Reactions, PlacingLeavesTheFieldAlone) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  std::mt19937_64 random(14);
  const auto now = test::random_landmarks(random, 12, 10, 3, 3),
             next = test::random_landmarks(random, 20, 10, 3, 3);
  ScalarKernelField field(tissue, Wendland31{}, 14, {}), fresh(tissue, Wendland31{}, 14, {});
  test::expect_factorize_leaves_the_field(field, fresh, now, next);
}

}  // namespace
}  // namespace brachy
