#include "core/needle/reaction_solver.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/work_budget.h"
#include "core/kernels/kernels.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Problem {
  Eigen::MatrixXd stiffness;
  std::vector<double> stuck, low, high;

  std::size_t size() const { return stuck.size(); }
};

struct Solution {
  std::vector<double> slips, reactions;
  ReactionSolver::Result result;
};

Solution solve(ReactionSolver& solver, const Problem& p) {
  Solution s{std::vector<double>(p.size()), std::vector<double>(p.size()), {}};
  s.result = solver.solve(p.stiffness, p.stuck, p.low, p.high, s.slips, s.reactions);
  return s;
}

double psi_of(const Kernel& kernel, double r) {
  return std::visit([&](const auto& psi) { return psi.value(r); }, kernel);
}

// A needle's shaft: points `spacing` mm apart on a line in a ψ kernel of support `support`, at 1 N/mm.
Problem shaft(std::size_t n, double spacing, double support, const Kernel& kernel) {
  const auto size = static_cast<Eigen::Index>(n);
  Eigen::MatrixXd K(size, size);
  for (Eigen::Index i = 0; i < size; ++i)
    for (Eigen::Index j = 0; j < size; ++j)
      K(i, j) = psi_of(kernel, spacing * static_cast<double>(std::abs(i - j)) / support);
  return {K.inverse(), std::vector<double>(n), std::vector<double>(n, -1), std::vector<double>(n, 1)};
}

void expect_solution(const Problem& p, const Solution& s, double tolerance = 1e-8) {
  ASSERT_TRUE(s.result.converged);
  EXPECT_LE(s.result.residual_n, tolerance);
  const auto n = static_cast<Eigen::Index>(p.size());
  const Eigen::VectorXd reaction = Eigen::Map<const Eigen::VectorXd>(p.stuck.data(), n) -
                                   p.stiffness * Eigen::Map<const Eigen::VectorXd>(s.slips.data(), n);
  for (std::size_t i = 0; i < p.size(); ++i) {
    EXPECT_NEAR(s.reactions[i], reaction[static_cast<Eigen::Index>(i)], tolerance);
    EXPECT_GE(s.reactions[i], p.low[i] - tolerance);
    EXPECT_LE(s.reactions[i], p.high[i] + tolerance);
    if (s.slips[i] > 0) {
      EXPECT_NEAR(s.reactions[i], p.high[i], tolerance);
    }
    if (s.slips[i] < 0) {
      EXPECT_NEAR(s.reactions[i], p.low[i], tolerance);
    }
  }
}

TEST(ReactionSolver, WhatStaysWithinItsBoundsSticks) {
  Problem p = shaft(6, 5, 12, *find_kernel("psi31"));
  p.stuck = {0.5, -0.25, 0, 1, -1, 0.75};
  ReactionSolver solver(6);
  const Solution s = solve(solver, p);
  EXPECT_EQ(s.slips, std::vector<double>(6, 0));
  EXPECT_EQ(s.reactions, p.stuck);
  EXPECT_EQ(s.result.pivots, 1);
}

TEST(ReactionSolver, OneLandmarkSlipsByWhatItsBoundLeaves) {
  Problem p{Eigen::MatrixXd::Constant(1, 1, 0.5), {2}, {-0.75}, {1}};
  ReactionSolver solver(1);
  EXPECT_NEAR(solve(solver, p).slips[0], (2 - 1) / 0.5, 1e-12);
  p.stuck = {-2};
  EXPECT_NEAR(solve(solver, p).slips[0], (-2 + 0.75) / 0.5, 1e-12);
}

TEST(ReactionSolver, WithoutBoundsNothingSlips) {
  Problem p = shaft(20, 5, 40, *find_kernel("psi32"));
  p.low.assign(20, -kInfinite);
  p.high.assign(20, kInfinite);
  std::mt19937_64 random(1);
  for (double& f : p.stuck) f = test::uniform(random, -100, 100);
  ReactionSolver solver(20);
  EXPECT_EQ(solve(solver, p).slips, std::vector<double>(20, 0));
}

TEST(ReactionSolver, WithoutFrictionNothingIsCarried) {
  Problem p = shaft(20, 5, 12, *find_kernel("psi31"));
  const Eigen::VectorXd wanted = Eigen::VectorXd::LinSpaced(20, 1, 3);
  const Eigen::VectorXd stuck = p.stiffness * wanted;
  p.stuck.assign(stuck.begin(), stuck.end());
  p.low.assign(20, 0);
  p.high.assign(20, 0);
  ReactionSolver solver(20);
  const Solution s = solve(solver, p);
  expect_solution(p, s);
  for (Eigen::Index i = 0; i < 20; ++i) EXPECT_NEAR(s.slips[static_cast<std::size_t>(i)], wanted[i], 1e-9);
}

// Random landmarks and bounds (one-sided, equal or infinite), from random starting sets.
TEST(ReactionSolver, SolvesRandomShaftsFromAnyStart) {
  std::mt19937_64 random(2);
  ReactionSolver solver(90);
  int most = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const std::size_t n = 1 + random() % 90;
    const char* kernels[] = {"psi30", "psi31", "psi32", "buhmann"};
    Problem p = shaft(n, test::uniform(random, 2, 8), test::uniform(random, 4, 30),
                      *find_kernel(kernels[random() % 4]));
    Eigen::VectorXd wanted(static_cast<Eigen::Index>(n));
    for (double& d : wanted) d = test::uniform(random, -3, 3);
    const Eigen::VectorXd stuck = p.stiffness * wanted;
    p.stuck.assign(stuck.begin(), stuck.end());
    for (std::size_t i = 0; i < n; ++i) {
      const double friction = test::uniform(random, 0, 0.5);
      p.low[i] = random() % 5 == 0 ? 0 : -friction;
      p.high[i] = random() % 7 == 0 ? kInfinite : random() % 5 == 0 ? p.low[i] : friction;
      if (p.high[i] < p.low[i]) p.high[i] = p.low[i];
    }
    const double scale = p.stiffness.cwiseAbs().maxCoeff();
    const Solution s = solve(solver, p);
    expect_solution(p, s, 1e-9 * (1 + 10 * scale));
    most = std::max(most, s.result.pivots);
    ASSERT_FALSE(HasFailure()) << "trial " << trial << ", " << n << " landmarks";
  }
  EXPECT_LT(most, WorkBudget::kReactionPivots / 2);
}

TEST(ReactionSolver, GoesOnFromTheLastSolution) {
  Problem p = shaft(30, 5, 12, *find_kernel("psi31"));
  p.low.assign(30, -0.1);
  p.high.assign(30, 0.1);
  Eigen::VectorXd wanted = Eigen::VectorXd::LinSpaced(30, 0.5, 4);
  ReactionSolver solver(30);
  for (int tick = 0; tick < 5; ++tick) {
    const Eigen::VectorXd stuck = p.stiffness * wanted;
    p.stuck.assign(stuck.begin(), stuck.end());
    const Solution s = solve(solver, p);
    expect_solution(p, s);
    if (tick > 0) {
      EXPECT_LE(s.result.pivots, 2);
    }
    wanted.array() += 0.025;
  }
}

}  // namespace
}  // namespace brachy
