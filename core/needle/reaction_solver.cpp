#include "core/needle/reaction_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "core/base/work_budget.h"

namespace brachy {
namespace {

constexpr int kPatience = 10;  // block pivots without a new least number of violations

}  // namespace

ReactionSolver::ReactionSolver(std::size_t capacity) {
  const auto n = static_cast<Eigen::Index>(capacity);
  stiffness_.resize(n, n);
  factor_.resize(n, n);
  for (Eigen::VectorXd* v : {&stuck_, &slip_, &reaction_, &solution_}) v->resize(n);
  sides_.reserve(capacity);
  wanted_.reserve(capacity);
  slipping_.reserve(capacity);
}

ReactionSolver::Result ReactionSolver::solve(const Eigen::Ref<const Eigen::MatrixXd>& stiffness,
                                             std::span<const double> stuck, std::span<const double> low,
                                             std::span<const double> high, std::span<double> slips,
                                             std::span<double> reactions) noexcept {
  count_ = static_cast<Eigen::Index>(stuck.size());
  stiffness_.topLeftCorner(count_, count_) = stiffness;
  stuck_.head(count_) = Eigen::Map<const Eigen::VectorXd>(stuck.data(), count_);
  double largest = 1;
  for (std::size_t i = 0; i < stuck.size(); ++i)
    for (const double bound : {low[i], high[i]})
      if (std::isfinite(bound)) largest = std::max(largest, std::abs(bound));
  tolerance_ = std::max(kTolerance * largest, kRounding * stuck_.head(count_).cwiseAbs().maxCoeff());
  if (sides_.size() != stuck.size()) sides_.assign(stuck.size(), kStuck);
  for (std::size_t i = 0; i < stuck.size(); ++i)  // nothing slips at an infinite bound
    if (!std::isfinite(sides_[i] == kLow ? low[i] : high[i])) sides_[i] = kStuck;

  Result result;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  int patience = kPatience;
  result.converged = false;
  while (result.pivots < WorkBudget::kReactionPivots) {
    ++result.pivots;
    if (!solve_for_sides(low, high)) break;
    const std::size_t violations = find_violations(low, high);
    if (violations == 0) {
      result.converged = true;
      break;
    }
    if (violations < fewest) {
      fewest = violations;
      patience = kPatience;
    } else {
      --patience;
    }
    if (patience > 0) {
      sides_ = wanted_;
      continue;
    }
    // A single pivot, the last violation: slow, but certain to end.
    const auto last = static_cast<std::size_t>(
        std::mismatch(sides_.rbegin(), sides_.rend(), wanted_.rbegin()).first.base() - sides_.begin() - 1);
    sides_[last] = wanted_[last];
  }

  for (std::size_t i = 0; i < stuck.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    slips[i] = slip_[k];
    reactions[i] = reaction_[k];
    const double at = sides_[i] == kLow ? low[i] : sides_[i] == kHigh ? high[i] : reaction_[k];
    result.residual_n = std::max(
        {result.residual_n, std::abs(reaction_[k] - at), low[i] - reaction_[k], reaction_[k] - high[i]});
  }
  return result;
}

// H_AA σ_A = φ*_A − bound_A on what slips; then φ everywhere.
bool ReactionSolver::solve_for_sides(std::span<const double> low, std::span<const double> high) noexcept {
  slipping_.clear();
  for (std::size_t i = 0; i < sides_.size(); ++i)
    if (sides_[i] != kStuck) slipping_.push_back(static_cast<Eigen::Index>(i));
  const auto m = static_cast<Eigen::Index>(slipping_.size());
  slip_.head(count_).setZero();
  if (m > 0) {
    auto H = factor_.topLeftCorner(m, m);
    auto x = solution_.head(m);
    for (Eigen::Index j = 0; j < m; ++j) {
      const Eigen::Index landmark = slipping_[static_cast<std::size_t>(j)];
      const auto at = static_cast<std::size_t>(landmark);
      x[j] = stuck_[landmark] - (sides_[at] == kLow ? low[at] : high[at]);
      for (Eigen::Index i = j; i < m; ++i)
        H(i, j) = stiffness_(slipping_[static_cast<std::size_t>(i)], landmark);
    }
    Eigen::Ref<Eigen::MatrixXd> in_place = H;
    if (Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(in_place).info() != Eigen::Success) return false;
    const auto L = H.triangularView<Eigen::Lower>();
    L.solveInPlace(x);
    L.transpose().solveInPlace(x);
    for (Eigen::Index j = 0; j < m; ++j) slip_[slipping_[static_cast<std::size_t>(j)]] = x[j];
  }
  evaluate();
  return true;
}

void ReactionSolver::evaluate() noexcept {
  auto reaction = reaction_.head(count_);
  reaction = stuck_.head(count_);
  for (const Eigen::Index j : slipping_) reaction.noalias() -= slip_[j] * stiffness_.col(j).head(count_);
}

// The set that each landmark's reaction asks for; returns how many are in another.
std::size_t ReactionSolver::find_violations(std::span<const double> low,
                                            std::span<const double> high) noexcept {
  wanted_.assign(sides_.begin(), sides_.end());
  std::size_t count = 0;
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (sides_[i] == kStuck) {
      if (reaction_[k] > high[i] + tolerance_) wanted_[i] = kHigh;
      if (reaction_[k] < low[i] - tolerance_) wanted_[i] = kLow;
    } else if (low[i] < high[i] && static_cast<double>(sides_[i]) * slip_[k] < 0) {
      wanted_[i] = kStuck;
    }
    count += wanted_[i] != sides_[i];
  }
  return count;
}

}  // namespace brachy
