// Appended and removed landmarks against factorizations from scratch and against long double.
#include <gtest/gtest.h>

#include "core/solve/rbf_system.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/core/solve/reference_solve.h"

namespace brachy {
namespace {

using test::reference_solve;
using test::relative_difference;
using test::solve;
using Sparse = RbfSystem::Sparse;

constexpr double kSupport = 12;

struct AppendRemove : ::testing::TestWithParam<Kernel> {
  std::vector<Vec3> fresh(SimdTarget target = best_simd_target()) const {
    RbfSystem system(GetParam(), kSupport, static_cast<int>(p.size()) + 1, target);
    EXPECT_TRUE(system.factorize(p));
    return solve(system, d);
  }
  void add(const test::RandomLandmarks& from, std::size_t i) {
    p.push_back(from.positions[i]);
    d.push_back(from.displacements[i]);
  }
  void drop(std::size_t i) {
    p.erase(p.begin() + static_cast<std::ptrdiff_t>(i));
    d.erase(d.begin() + static_cast<std::ptrdiff_t>(i));
  }

  std::mt19937_64 random{21};
  const test::RandomLandmarks pool = test::random_landmarks(random, 70, 20, 3, 5);
  std::vector<Vec3> p, d;
};

TEST_P(AppendRemove, AppendedOneByOneIsAFactorizationBitForBit) {
  for (const SimdTarget target :
       {SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2, SimdTarget::kAvx512}) {
    if (!is_supported(target)) continue;
    p.clear();
    d.clear();
    RbfSystem system(GetParam(), kSupport, 70, target);
    for (std::size_t i = 0; i < 70; ++i) {
      add(pool, i);
      ASSERT_TRUE(system.append(p.back()));
      ASSERT_EQ(solve(system, d), fresh(target)) << to_string(target) << " n=" << i + 1;
    }
  }
}

TEST_P(AppendRemove, RefactorizingKeepsLeadingLandmarksBitForBit) {
  RbfSystem system(GetParam(), kSupport, 70);
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t kept = random() % (p.size() + 1);
    p.resize(kept);
    d.resize(kept);
    const std::size_t n = random() % 71;
    for (std::size_t i = kept; i < n; ++i) {
      add(pool, i);
      p.back() += test::uniform_point(random, 0.1);
    }
    ASSERT_TRUE(system.refactorize(p));
    ASSERT_EQ(solve(system, d), fresh()) << kept << " of " << n;
  }
}

TEST_P(AppendRemove, RandomSequencesEqualLongDouble) {
  for (const Sparse sparse : {Sparse::kNever, Sparse::kAlways}) {
    p.clear();
    d.clear();
    RbfSystem system(GetParam(), kSupport, 70, best_simd_target(), sparse);
    for (std::size_t i = 0; i < 35; ++i) add(pool, i);
    ASSERT_TRUE(system.factorize(p));
    std::vector<std::size_t> held(35), spare(35);
    for (std::size_t i = 0; i < 35; ++i) held[i] = i, spare[i] = 35 + i;
    for (int step = 0; step < 300; ++step) {
      if (!spare.empty() && (held.empty() || random() % 2)) {
        add(pool, spare.back());
        ASSERT_TRUE(system.append(p.back()));
        held.push_back(spare.back());
        spare.pop_back();
      } else {
        const std::size_t i = random() % held.size();
        system.remove(static_cast<int>(i));
        drop(i);
        spare.push_back(held[i]);
        held.erase(held.begin() + static_cast<std::ptrdiff_t>(i));
      }
      ASSERT_EQ(system.size(), static_cast<int>(p.size()));
      if (step % 10 != 0 || p.empty()) continue;
      ASSERT_LT(relative_difference(solve(system, d), reference_solve(GetParam(), kSupport, p, d)), 1e-11)
          << "step " << step << " n=" << p.size();
    }
  }
}

TEST_P(AppendRemove, ADuplicateIsRefusedByNameAndTheFactorStands) {
  for (std::size_t i = 0; i < 20; ++i) add(pool, i);
  RbfSystem system(GetParam(), kSupport, 21);
  ASSERT_TRUE(system.factorize(p));
  const auto before = solve(system, d);
  const FactorStatus status = system.append(p[7] + Vec3(1e-6, 0, 0));
  EXPECT_EQ(status.kind, FactorStatus::kDuplicate);
  EXPECT_EQ(status.first, 7);
  EXPECT_EQ(status.second, 20);
  EXPECT_EQ(system.append({NAN, 0, 0}).kind, FactorStatus::kNotFinite);
  EXPECT_EQ(solve(system, d), before);
  add(pool, 20);
  ASSERT_TRUE(system.append(p.back()));
  EXPECT_EQ(solve(system, d), fresh());
}

TEST_P(AppendRemove, ColumnsAreThoseOfTheInverse) {
  for (std::size_t i = 0; i < 40; ++i) add(pool, i);
  for (const Sparse sparse : {Sparse::kNever, Sparse::kAlways}) {
    RbfSystem system(GetParam(), kSupport, 40, best_simd_target(), sparse);
    ASSERT_TRUE(system.factorize(p));
    const std::vector<std::uint32_t> landmarks{39, 3, 17, 0, 20};
    std::vector<double> columns(40 * 6, -1);  // stride 6: the sixth column is unused
    system.solve_columns(landmarks, columns.data(), 6);
    for (std::size_t k = 0; k < 5; ++k) {
      std::vector<Vec3> unit(40, Vec3::Zero());
      unit[landmarks[k]] = Vec3(1, 0, 0);
      const auto column = solve(system, unit);
      for (std::size_t j = 0; j < 40; ++j) EXPECT_NEAR(columns[j * 6 + k], column[j].x(), 1e-13);
    }
    for (std::size_t j = 0; j < 40; ++j) EXPECT_EQ(columns[j * 6 + 5], -1);
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, AppendRemove, ::testing::ValuesIn(test::all_kernels()),
                         [](const auto& k) { return std::string(name_of(k.param)); });

TEST(RbfSystem, ALandmarkThatCostsDefinitenessIsRefusedAndTheFactorStands) {
  // ψ3,2 at a = 40: 27 landmarks well apart, one of them gone again, then more 1e-3 mm apart: soon λmin is below
  // rounding (core/DESIGN.md, section 4).
  std::mt19937_64 random(6);
  const auto L = test::random_landmarks(random, 28, 40, 12, 5);
  RbfSystem system(Wendland32{}, 40, 64);
  ASSERT_TRUE(system.factorize(L.positions));
  system.remove(3);
  auto p = L.positions, d = L.displacements;
  p.erase(p.begin() + 3);
  d.erase(d.begin() + 3);
  std::vector<Vec3> before;
  Vec3 next;
  FactorStatus status;
  for (int i = 0; i < 40 && status; ++i) {
    before = solve(system, d);
    next = Vec3(50 + i * 1e-3, 0, 0);
    status = system.append(next);
    if (!status) break;
    p.push_back(next);
    d.push_back({1, 2, 3});
  }
  ASSERT_EQ(status.kind, FactorStatus::kNotPositiveDefinite);
  ASSERT_NE(system.size() % 16, 0);  // the refused row shared its panel with others
  EXPECT_EQ(solve(system, d), before);
  p.push_back({0, 200, 0});
  d.push_back({0, 0, 1});
  ASSERT_TRUE(system.append(p.back()));
  EXPECT_LT((solve(system, d).back() - d.back()).norm(), 1e-15);  // out of reach of all others

  system.remove(system.size() - 1);
  EXPECT_EQ(system.append(next).kind, FactorStatus::kNotPositiveDefinite);
  p.resize(p.size() - 2);
  d.resize(p.size());
  p.back().y() += 5;
  ASSERT_TRUE(system.refactorize(p));
  RbfSystem fresh(Wendland32{}, 40, 64);
  ASSERT_TRUE(fresh.factorize(p));
  EXPECT_LT(relative_difference(solve(system, d), solve(fresh, d)), 1e-6);
}

TEST(RbfSystem, FillsToItsCapacityAndEmpties) {
  std::mt19937_64 random(5);
  const auto L = test::random_landmarks(random, 34, 20, 4, 5);
  for (const int capacity : {1, 7, 8, 15, 16, 17, 32, 33}) {
    RbfSystem system(Wendland31{}, kSupport, capacity);
    for (int round = 0; round < 2; ++round) {
      std::vector<Vec3> p, d;
      for (int i = 0; i < capacity; ++i) {
        p.push_back(L.positions[static_cast<std::size_t>(i)]);
        d.push_back(L.displacements[static_cast<std::size_t>(i)]);
        ASSERT_TRUE(system.append(p.back()));
      }
      system.remove(0);  // the longest way through the factor, then full again
      p.erase(p.begin());
      p.push_back(L.positions.back());
      ASSERT_TRUE(system.append(p.back()));
      EXPECT_LT(relative_difference(solve(system, d), reference_solve(Wendland31{}, kSupport, p, d)), 1e-12);
      while (system.size() > 0) system.remove(system.size() / 2);
    }
    EXPECT_TRUE(system.factorize({}));
    EXPECT_EQ(system.size(), 0);
  }
}

}  // namespace
}  // namespace brachy
