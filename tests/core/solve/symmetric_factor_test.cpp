#include "core/solve/symmetric_factor.h"

#include <gtest/gtest.h>

#include <random>

#include <Eigen/Cholesky>

namespace brachy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr std::size_t kFew = 30,
                      kMany = 71;  // landmarks: by Eigen, and by panels, the last of which is not full

/// Of landmarks on a grid, as a compliance falls with the distance; and landmarks from `moved` on are elsewhere.
MatrixXd compliance(std::size_t landmarks, std::size_t moved, double by) {
  std::vector<Vec3> at;
  for (std::size_t l = 0; l < landmarks; ++l)
    at.push_back(
        Vec3(static_cast<double>(l % 4), static_cast<double>(l / 4 % 4), static_cast<double>(l / 16)) +
        (l >= moved ? by : 0.0) * Vec3(0.3, 0.2, 0.1));
  MatrixXd K(static_cast<Index>(3 * landmarks), static_cast<Index>(3 * landmarks));
  for (std::size_t i = 0; i < landmarks; ++i)
    for (std::size_t j = 0; j < landmarks; ++j) {
      const Vec3 x = at[i] - at[j];
      const double r = std::sqrt(x.squaredNorm() + 0.1);
      K.block<3, 3>(static_cast<Index>(3 * i), static_cast<Index>(3 * j)) =
          Mat3::Identity() / r + x * x.transpose() / (r * r * r);
    }
  K.diagonal().array() += 8;  // definite whatever the places
  return K;
}

std::vector<Vec3> unit_vectors(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Vec3> all(count);
  for (Vec3& v : all) v = Vec3(normal(random), normal(random), normal(random)).normalized();
  return all;
}

bool factor(SymmetricFactor& factor, const MatrixXd& K) {
  factor.begin(static_cast<std::size_t>(K.rows()) / 3).triangularView<Eigen::Lower>() = K;
  return factor.factor();
}

struct Results {
  std::vector<Vec3> solved;
  MatrixXd H;
  std::vector<double> stiffness = std::vector<double>(2);
  double condition = 0;
};

Results results(SymmetricFactor& factor, std::size_t landmarks, std::size_t first = 0) {
  Results r;
  r.solved = unit_vectors(landmarks, 1);
  factor.solve(r.solved);
  const std::vector<Vec3> axes = unit_vectors(landmarks, 2);
  const auto m = static_cast<Index>(landmarks - first);
  r.H.resize(m, m);
  factor.project(first, std::span(axes).subspan(first), r.H);
  std::vector<std::uint32_t> group_of(landmarks, SymmetricFactor::kNoGroup);
  for (std::size_t l = 3; l < landmarks; ++l) group_of[l] = l < 10 || l + 2 > landmarks ? 0 : 1;
  std::vector<Vec3> motions(landmarks, Vec3::Zero());
  for (std::size_t l = 3; l < landmarks; ++l) motions[l] = axes[group_of[l]];
  factor.rigid_stiffness(group_of, motions, r.stiffness);
  r.condition = factor.condition();
  return r;
}

class FactorOf : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(SymmetricFactor, FactorOf, testing::Values(kFew, kMany));

TEST_P(FactorOf, SolvesProjectsAndCondenses) {
  const std::size_t n = GetParam();
  const MatrixXd K = compliance(n, n, 0);
  SymmetricFactor tested(n + 5, best_simd_target());
  ASSERT_TRUE(factor(tested, K));
  const MatrixXd inverse = K.inverse();
  const std::vector<Vec3> d = unit_vectors(n, 1), axes = unit_vectors(n, 2);
  const Results found = results(tested, n, 2);
  MatrixXd A = MatrixXd::Zero(K.rows(), static_cast<Index>(n)), groups = MatrixXd::Zero(K.rows(), 2);
  Eigen::VectorXd all(K.rows());
  for (std::size_t l = 0; l < n; ++l) {
    const auto at = static_cast<Index>(3 * l);
    all.segment<3>(at) = d[l];
    A.block<3, 1>(at, static_cast<Index>(l)) = axes[l];
    if (l < 3) continue;
    const Index group = l < 10 || l + 2 > n ? 0 : 1;
    groups.block<3, 1>(at, group) = axes[static_cast<std::size_t>(group)];
  }
  const Eigen::VectorXd x = inverse * all;
  for (std::size_t l = 0; l < n; ++l)
    EXPECT_LT((found.solved[l] - x.segment<3>(static_cast<Index>(3 * l))).norm(), 1e-10) << l;
  const auto m = static_cast<Index>(n - 2);
  EXPECT_LT((found.H - (A.transpose() * inverse * A).bottomRightCorner(m, m)).cwiseAbs().maxCoeff(), 1e-10);
  for (Index g = 0; g < 2; ++g)
    EXPECT_NEAR(found.stiffness[static_cast<std::size_t>(g)], groups.col(g).dot(inverse * groups.col(g)),
                1e-10);
  const double condition =
      K.cwiseAbs().colwise().sum().maxCoeff() * inverse.cwiseAbs().colwise().sum().maxCoeff();
  EXPECT_LE(found.condition, condition * (1 + 1e-10));
  EXPECT_GE(found.condition, 0.3 * condition);
}

TEST_P(FactorOf, RefusesWhatIsNotDefiniteAndGoesOn) {
  const std::size_t n = GetParam();
  const MatrixXd K = compliance(n, n, 0);
  MatrixXd indefinite = K;
  indefinite(K.rows() - 1, K.rows() - 1) = -1;
  SymmetricFactor tested(n, best_simd_target()), fresh(n, best_simd_target());
  ASSERT_TRUE(factor(tested, K));
  EXPECT_FALSE(factor(tested, indefinite));
  ASSERT_TRUE(factor(tested, K));
  ASSERT_TRUE(factor(fresh, K));
  EXPECT_EQ(results(tested, n).solved, results(fresh, n).solved);
}

TEST(SymmetricFactor, HasTheSameBitsWhateverWasFactoredBefore) {
  SymmetricFactor kept(kMany + 9, best_simd_target());
  double by = 0;
  // Some landmarks move, come and go, all do, and again; now and then so few are left that panels are left aside.
  for (const auto& [landmarks, moved] :
       std::initializer_list<std::pair<std::size_t, std::size_t>>{{kMany, 60},
                                                                  {kMany, 60},
                                                                  {kMany, 66},
                                                                  {kMany + 3, 66},
                                                                  {kMany + 9, 66},
                                                                  {kMany + 2, 30},
                                                                  {kMany, 0},
                                                                  {kFew, 20},
                                                                  {kMany, 64},
                                                                  {kMany, 65},
                                                                  {kMany + 1, 65}}) {
    const MatrixXd K = compliance(landmarks, moved, ++by);
    SymmetricFactor fresh(kMany + 9, best_simd_target());
    ASSERT_TRUE(factor(kept, K));
    ASSERT_TRUE(factor(fresh, K));
    const Results a = results(kept, landmarks), b = results(fresh, landmarks);
    EXPECT_EQ(a.solved, b.solved) << by;
    EXPECT_EQ(a.H, b.H) << by;
    EXPECT_EQ(a.stiffness, b.stiffness) << by;
    EXPECT_EQ(a.condition, b.condition) << by;
  }
}

/// Columns of three groups of landmarks, far larger than K, one of them of nothing.
MatrixXd columns_of(std::size_t landmarks, double by) {
  MatrixXd U = MatrixXd::Zero(static_cast<Index>(3 * landmarks), 21);
  const std::vector<Vec3> values = unit_vectors(21 * landmarks, 5);
  for (std::size_t l = 0; l < landmarks; ++l)
    for (std::size_t c = 7 * (l % 3); c < 7 * (l % 3) + 7; ++c)
      if (c != 9)
        U.block<3, 1>(static_cast<Index>(3 * l), static_cast<Index>(c)) = (20 + by) * values[21 * l + c];
  return U;
}

void add(SymmetricFactor& factor, const MatrixXd& U) {
  LowRankTerm& added = factor.add_columns(static_cast<std::size_t>(U.cols()),
                                          (U * U.transpose()).cwiseAbs().colwise().sum().maxCoeff());
  for (Index l = 0; l < U.rows() / 3; ++l)
    for (Index c = 0; c < U.cols(); ++c)
      if (const Vec3 value = U.block<3, 1>(3 * l, c); value != Vec3::Zero())
        added.add(static_cast<std::size_t>(l), static_cast<std::size_t>(c), value);
}

bool factor(SymmetricFactor& factor, const MatrixXd& K, const MatrixXd& U) {
  factor.begin(static_cast<std::size_t>(K.rows()) / 3).triangularView<Eigen::Lower>() = K;
  add(factor, U);
  return factor.factor();
}

TEST(SymmetricFactor, SolvesWithAddedColumnsAsWithTheirSum) {
  const MatrixXd K = compliance(kMany, kMany, 0), U = columns_of(kMany, 0);
  SymmetricFactor added(kMany + 3, best_simd_target(), 30), whole(kMany + 3, best_simd_target());
  ASSERT_TRUE(factor(added, K, U));
  ASSERT_TRUE(factor(whole, K + U * U.transpose()));
  const Results a = results(added, kMany, 4), b = results(whole, kMany, 4);
  for (std::size_t l = 0; l < kMany; ++l) EXPECT_LT((a.solved[l] - b.solved[l]).norm(), 1e-9) << l;
  EXPECT_LT((a.H - b.H).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(a.H, a.H.transpose());
  for (std::size_t g = 0; g < 2; ++g) EXPECT_NEAR(a.stiffness[g], b.stiffness[g], 1e-9);
  const auto norm = [](const MatrixXd& M) { return M.cwiseAbs().colwise().sum().maxCoeff(); };
  const MatrixXd C = U * U.transpose(), inverse = (K + C).inverse();
  EXPECT_LE(a.condition, (norm(K) + norm(C)) * norm(inverse) * (1 + 1e-9));
  EXPECT_GE(a.condition, 0.3 * norm(K + C) * norm(inverse));
  EXPECT_GT(norm(C), 10 * norm(K));
}

TEST(SymmetricFactor, HasTheSameBitsWhateverColumnsWereAddedBefore) {
  SymmetricFactor kept(kMany, best_simd_target(), 21);
  for (const int by : {1, 2, 3, 4, 5}) {
    const MatrixXd K = compliance(kMany, by > 3 ? 65 : 68, by), U = columns_of(kMany, by);
    SymmetricFactor fresh(kMany, best_simd_target(), 21);
    const bool is_plain = by == 3;
    ASSERT_TRUE(is_plain ? factor(kept, K) : factor(kept, K, U));
    ASSERT_TRUE(is_plain ? factor(fresh, K) : factor(fresh, K, U));
    const Results a = results(kept, kMany), b = results(fresh, kMany);
    EXPECT_EQ(a.solved, b.solved) << by;
    EXPECT_EQ(a.H, b.H) << by;
    EXPECT_EQ(a.stiffness, b.stiffness) << by;
    EXPECT_EQ(a.condition, b.condition) << by;
  }
}

TEST(SymmetricFactor, GoesOnWithTheSameMatrixAndOtherColumns) {
  const MatrixXd K = compliance(kMany, kMany, 0), U = columns_of(kMany, 3);
  SymmetricFactor kept(kMany, best_simd_target(), 21), fresh(kMany, best_simd_target(), 40);
  EXPECT_FALSE(kept.keeps(kMany));
  ASSERT_TRUE(factor(kept, K, columns_of(kMany, 0)));
  ASSERT_TRUE(kept.keeps(kMany));
  EXPECT_FALSE(kept.keeps(kMany - 1));
  kept.begin_again();
  add(kept, U);
  ASSERT_TRUE(kept.factor());
  ASSERT_TRUE(factor(fresh, K, U));
  Results a = results(kept, kMany), b = results(fresh, kMany);
  EXPECT_EQ(a.solved, b.solved);
  EXPECT_EQ(a.H, b.H);
  EXPECT_EQ(a.stiffness, b.stiffness);
  EXPECT_EQ(a.condition, b.condition);
  kept.begin_again();
  ASSERT_TRUE(kept.factor());
  ASSERT_TRUE(factor(fresh, K));
  a = results(kept, kMany), b = results(fresh, kMany);
  EXPECT_EQ(a.solved, b.solved);
  EXPECT_EQ(a.H, b.H);
  EXPECT_EQ(a.condition, b.condition);
}

TEST(SymmetricFactor, TakesNoColumnsOfFewLandmarksNorMoreThanItHasSpaceFor) {
  SymmetricFactor tested(kMany, best_simd_target(), 21), none(kMany, best_simd_target());
  EXPECT_FALSE(tested.takes(kFew, 2));
  EXPECT_TRUE(tested.takes(kMany, 21));
  EXPECT_FALSE(tested.takes(kMany, kMany));
  EXPECT_FALSE(none.takes(kMany, 1));
}

}  // namespace
}  // namespace brachy
