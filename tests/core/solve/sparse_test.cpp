// Large landmark sets: the envelope against the dense factor, and no allocation at any size.
#include <gtest/gtest.h>

#include <cmath>

#include "core/solve/rbf_system.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/core/solve/reference_solve.h"

namespace brachy {
namespace {

using test::relative_difference;
using test::solve;
using Sparse = RbfSystem::Sparse;

/// A cubic grid of 1 mm, 10 × 10 × n/100, jittered by ±0.2, in random order.
std::vector<Vec3> grid(int n) {
  std::mt19937_64 random(7);
  std::vector<Vec3> p;
  for (int i = 0; i < n; ++i)
    p.push_back(Vec3(i % 10, i / 10 % 10, i / 100) + test::uniform_point(random, 0.2));
  for (std::size_t i = p.size(); i > 1; --i) std::swap(p[i - 1], p[random() % i]);
  return p;
}

std::vector<Vec3> sphere(int n) {
  const double radius = std::sqrt(n / (4 * M_PI));
  std::vector<Vec3> p;
  for (int k = 0; k < n; ++k) {
    const double z = 1 - (2.0 * k + 1) / n, r = std::sqrt(1 - z * z),
                 t = 2.399963229728653 * k;  // golden angle
    p.push_back(radius * Vec3(r * std::cos(t), r * std::sin(t), z));
  }
  return p;
}

std::vector<Vec3> some_displacements(std::size_t n) {
  std::mt19937_64 random(8);
  std::vector<Vec3> d;
  for (std::size_t i = 0; i < n; ++i) d.push_back(test::uniform_point(random, 5));
  return d;
}

RbfSystem make(const std::vector<Vec3>& p, Sparse sparse) {
  RbfSystem system(Wendland31{}, 4, static_cast<int>(p.size()) + 2, best_simd_target(), sparse);
  EXPECT_TRUE(system.factorize(p));
  return system;
}

TEST(SparseSystem, EqualsTheDenseOneAt2000Landmarks) {
  for (const auto& p : {grid(2000), sphere(2000)}) {
    RbfSystem dense = make(p, Sparse::kNever), sparse = make(p, Sparse::kAuto);
    EXPECT_FALSE(dense.is_sparse());
    EXPECT_TRUE(sparse.is_sparse());
    const auto d = some_displacements(p.size());
    EXPECT_LT(relative_difference(solve(sparse, d), solve(dense, d)), 1e-9);
  }
}

TEST(RbfSystem, ALargeDenseFactorGrowsBitForBit) {
  const auto p = grid(400);
  const auto d = some_displacements(p.size());
  RbfSystem grown(Wendland31{}, 4, 400, best_simd_target(), Sparse::kNever), fresh = make(p, Sparse::kNever);
  ASSERT_TRUE(grown.factorize(std::span(p).first(390)));
  for (std::size_t i = 390; i < 400; ++i) ASSERT_TRUE(grown.append(p[i]));
  EXPECT_EQ(solve(grown, d), solve(fresh, d));
}

TEST(SparseSystem, StaysEqualWhileLandmarksComeAndGo) {
  auto p = grid(600);
  RbfSystem dense = make(p, Sparse::kNever), sparse = make(p, Sparse::kAuto);
  auto close = p;  // fills all of the storage first: data outside the envelope must not matter
  for (Vec3& q : close) q *= 0.2;
  ASSERT_TRUE(sparse.factorize(close));
  ASSERT_FALSE(sparse.is_sparse());
  ASSERT_TRUE(sparse.factorize(p));
  ASSERT_TRUE(sparse.is_sparse());
  std::mt19937_64 random(9);
  const auto d = some_displacements(p.size());
  for (int step = 0; step < 60; ++step) {
    const std::size_t i = random() % p.size();
    const Vec3 moved = p[i] + test::uniform_point(random, 0.05);
    p.erase(p.begin() + static_cast<std::ptrdiff_t>(i));
    p.push_back(moved);
    for (RbfSystem* system : {&dense, &sparse}) {
      system->remove(static_cast<int>(i));
      ASSERT_TRUE(system->append(moved));
    }
    ASSERT_LT(relative_difference(solve(sparse, d), solve(dense, d)), 1e-11) << step;
  }
  RbfSystem fresh = make(p, Sparse::kNever);
  EXPECT_LT(relative_difference(solve(sparse, d), solve(fresh, d)), 1e-11);
}

TEST(SparseSystem, ATipThatMovesKeepsTheFactorOfTheOthers) {
  auto p = grid(400);
  const auto d = some_displacements(p.size());
  RbfSystem sparse = make(p, Sparse::kAuto), again = make(p, Sparse::kAuto);
  for (int tick = 0; tick < 20; ++tick) {
    p.back() += Vec3(0.01, 0.02, 0.1);
    ASSERT_TRUE(sparse.refactorize(p));
    ASSERT_TRUE(again.refactorize(p));
    RbfSystem fresh = make(p, Sparse::kNever);
    ASSERT_LT(relative_difference(solve(sparse, d), solve(fresh, d)), 1e-11) << tick;
    ASSERT_EQ(solve(sparse, d), solve(again, d));
  }
  EXPECT_TRUE(sparse.is_sparse());
}

TEST(SparseSystem, IsChosenByCountAndEmptiness) {
  EXPECT_FALSE(make(grid(200), Sparse::kAuto).is_sparse());  // small
  EXPECT_TRUE(make(grid(500), Sparse::kAuto).is_sparse());
  const auto p = grid(300);
  RbfSystem wide(Wendland31{}, 40, 300);  // everything reaches everything
  ASSERT_TRUE(wide.factorize(p));
  EXPECT_FALSE(wide.is_sparse());
}

TEST(SparseSystem, DuplicatesAreRefusedByTheLandmarksOwnNumbers) {
  auto p = grid(500);
  p[401] = p[77];
  RbfSystem system(Wendland31{}, 4, 500);
  const FactorStatus status = system.factorize(p);
  EXPECT_EQ(status.kind, FactorStatus::kDuplicate);
  EXPECT_EQ(status.first, 77);
  EXPECT_EQ(status.second, 401);
  EXPECT_EQ(system.size(), 0);
}

TEST(RbfSystem, AllTargetsAgree) {
  const auto p = grid(300);
  const auto d = some_displacements(p.size());
  std::vector<Vec3> first;
  for (const SimdTarget target :
       {SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2, SimdTarget::kAvx512}) {
    if (!is_supported(target)) continue;
    RbfSystem system(Wendland31{}, 4, 300, target, Sparse::kNever);
    ASSERT_TRUE(system.factorize(p));
    const auto weights = solve(system, d);
    if (first.empty()) first = weights;
    EXPECT_LT(relative_difference(weights, first), 1e-12) << to_string(target);
  }
}

TEST(RbfSystem, NothingAllocatesAtAnySize) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "a sanitizer owns malloc";
  for (const int n : {100, 1000, 2000})
    for (const Sparse sparse : {Sparse::kNever, Sparse::kAlways}) {
      auto p = grid(n);
      const auto d = some_displacements(p.size());
      std::vector<Vec3> weights(p.size());
      std::vector<double> columns(p.size() * 4);
      const std::uint32_t landmarks[] = {0, 1, 2, 99};
      RbfSystem system(Wendland31{}, 4, n, best_simd_target(), sparse);
      const std::uint64_t before = test::allocation_count();
      bool ok = static_cast<bool>(system.factorize(p));
      system.solve(d, weights);
      system.solve_columns(landmarks, columns.data(), 4);
      system.remove(n / 2);
      ok = ok && system.append(p[static_cast<std::size_t>(n / 2)]);
      p.back().x() += 0.1;
      ok = ok && system.refactorize(p);
      EXPECT_EQ(test::allocation_count() - before, 0u) << n;
      EXPECT_TRUE(ok);
    }
}

}  // namespace
}  // namespace brachy
