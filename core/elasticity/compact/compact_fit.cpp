#include "core/elasticity/compact/compact_fit.h"

#include <cmath>
#include <limits>

#include <Eigen/QR>

#include "core/elasticity/compact/compact_kernel.h"

namespace brachy {
namespace {

constexpr Eigen::Index kDistances = 241;  // 0 … wall
constexpr double kSupports[] = {1.0 / 16, 1.0 / 8, 1.0 / 4, 1.0 / 2, 1};

// 4πμ G of two ends of one core: across and along the force.
struct Pair {
  double across, along;
  double mean() const { return (2 * across + along) / 3; }
};

Pair regularised_kelvin(double r, double core, double poisson) {
  const double b = 1 / (4 * (1 - poisson));
  const double q = std::hypot(r, core), q3 = q * q * q;
  const double across = (1 - b) / q + 0.5 * core * core / q3;
  return {across, across + b * r * r / q3};
}

}  // namespace

CompactFit fit_compact(double poisson, double core, double wall) {
  const Eigen::Index n = std::size(kSupports);
  Eigen::MatrixXd A(2 * kDistances, 2 * n);
  Eigen::VectorXd aim(2 * kDistances);
  const double rest = regularised_kelvin(wall, core, poisson).mean();
  for (Eigen::Index i = 0; i < kDistances; ++i) {
    const double r = wall * static_cast<double>(i) / (kDistances - 1), weight = std::sqrt(r + core);
    const Pair G = regularised_kelvin(r, core, poisson);
    aim[2 * i] = weight * (G.across - rest);
    aim[2 * i + 1] = weight * (G.along - rest);
    for (Eigen::Index k = 0; k < n; ++k) {
      const CompactTerm psi{kSupports[k] * wall, 1, 0}, phi{kSupports[k] * wall, 0, 1};
      const auto set = [&](Eigen::Index column, const CompactTerm& term) {
        const CompactValue C = compact_value(term, r);
        A(2 * i, column) = weight * C.across;
        A(2 * i + 1, column) = weight * (C.across + C.outer * r * r);
      };
      set(k, psi);
      set(n + k, phi);
    }
  }
  const Eigen::VectorXd x = nonnegative_least_squares(A, aim);
  CompactFit fit;
  for (Eigen::Index k = 0; k < n; ++k) fit.terms.push_back({kSupports[k] * wall, x[k], x[n + k]});
  fit.residual = (A * x - aim).norm() / aim.norm();
  return fit;
}

Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  const Eigen::Index n = A.cols();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::Index> passive;  // where x may be positive; elsewhere it is 0
  std::vector<bool> is_passive(static_cast<std::size_t>(n));
  const auto solve_passive = [&] {
    Eigen::MatrixXd P(A.rows(), static_cast<Eigen::Index>(passive.size()));
    for (Eigen::Index k = 0; k < P.cols(); ++k) P.col(k) = A.col(passive[static_cast<std::size_t>(k)]);
    return Eigen::VectorXd(P.colPivHouseholderQr().solve(b));
  };
  // Each iteration lowers the residual, so no passive set recurs; the bound guards against rounding alone.
  for (Eigen::Index round = 0; round < 10 * n; ++round) {
    const Eigen::VectorXd descent = A.transpose() * (b - A * x);
    Eigen::Index best = -1;
    double steepest = 1e-12 * b.norm();  // per unit of a column's length
    for (Eigen::Index j = 0; j < n; ++j) {
      if (is_passive[static_cast<std::size_t>(j)] || descent[j] <= steepest * A.col(j).norm()) continue;
      steepest = descent[j] / A.col(j).norm();
      best = j;
    }
    if (best < 0) break;
    passive.push_back(best);
    is_passive[static_cast<std::size_t>(best)] = true;
    // As far towards the passive set's own solution as x stays ≥ 0; a component that reaches 0 leaves the set.
    while (!passive.empty()) {
      const Eigen::VectorXd s = solve_passive();
      double step = 1;
      Eigen::Index first = -1;
      for (Eigen::Index k = 0; k < s.size(); ++k) {
        const double now = x[passive[static_cast<std::size_t>(k)]];
        if (s[k] > 0 || now / (now - s[k]) >= step) continue;
        step = now / (now - s[k]);
        first = k;
      }
      for (Eigen::Index k = 0; k < s.size(); ++k) {
        double& now = x[passive[static_cast<std::size_t>(k)]];
        now += step * (s[k] - now);
      }
      if (first < 0) break;
      const Eigen::Index out = passive[static_cast<std::size_t>(first)];
      x[out] = 0;
      is_passive[static_cast<std::size_t>(out)] = false;
      passive.erase(passive.begin() + first);
    }
  }
  return x;
}

}  // namespace brachy
