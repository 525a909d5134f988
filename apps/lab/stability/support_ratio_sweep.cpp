// Support radii that differ from landmark to landmark. The paper's rule K_ij = ψ(|p_i − p_j|/a_j) is regular
// for one common radius only; three landmarks h apart with radii (4h, 11.660167858376596 h, 4h) are exactly
// singular for ψ3,1 (core/DESIGN.md, section 2). The positive definite rule is K_ij = Σ_m w_m(p_i) w_m(p_j)
// ψ(|p_i − p_j|/a_m), Σ_m w_m² = 1. Both are computed here with dense matrices.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "apps/lab/stability/landmark_systems.h"
#include "apps/lab/stability/sweeps.h"

namespace brachy {
namespace {

using Eigen::MatrixXd;

struct Landmarks {
  std::vector<Vec3> positions;
  std::vector<double> supports;         // by landmark, mm
  std::vector<double> tissue_supports;  // by tissue, mm
  std::vector<Eigen::VectorXd> shares;  // by landmark: w_m
};

MatrixXd papers_matrix(const Kernel& kernel, const Landmarks& l) {
  const auto n = static_cast<Eigen::Index>(l.positions.size());
  MatrixXd K(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      const double r = (l.positions[a] - l.positions[b]).norm() / l.supports[b];
      K(i, j) = std::visit([r](auto psi) { return psi.value(r); }, kernel);
    }
  return K;
}

MatrixXd definite_matrix(const Kernel& kernel, const Landmarks& l) {
  const auto n = static_cast<Eigen::Index>(l.positions.size());
  MatrixXd K = MatrixXd::Zero(n, n);
  for (std::size_t m = 0; m < l.tissue_supports.size(); ++m) {
    Eigen::VectorXd w(n);
    for (Eigen::Index i = 0; i < n; ++i)
      w[i] = l.shares[static_cast<std::size_t>(i)][static_cast<Eigen::Index>(m)];
    K += w.asDiagonal() * psi_matrix(kernel, l.tissue_supports[m], l.positions) * w.asDiagonal();
  }
  return K;
}

/// h = 1. The middle landmark is in another tissue.
Landmarks triple(double ratio) {
  const Eigen::Vector2d outer(1, 0), middle(0, 1);
  return {unit_shaft(3), {4, 4 * ratio, 4}, {4, 4 * ratio}, {outer, middle, outer}};
}

/// Up to 200 landmarks in a gland of 40 mm, at least 0.5 mm apart; radii from 6 mm to `ratio` times that,
/// evenly in their logarithm; four tissues, of which each landmark has some share. The same draws for every ratio.
Landmarks random_landmarks(unsigned seed, double ratio) {
  std::mt19937 random(seed);
  const auto draw = [&] { return static_cast<double>(random()) / 4294967296.0; };
  Landmarks l;
  const auto n = static_cast<std::size_t>(2 + 199 * draw());
  while (l.positions.size() < n) {
    const double x = draw(), y = draw(), z = draw();
    const Vec3 p = 40 * Vec3(x, y, z);
    if (std::ranges::none_of(l.positions, [&](const Vec3& q) { return (p - q).norm() < 0.5; }))
      l.positions.push_back(p);
  }
  for (int m = 0; m < 4; ++m) l.tissue_supports.push_back(6 * std::pow(ratio, m / 3.0));
  for (std::size_t i = 0; i < n; ++i) {
    l.supports.push_back(6 * std::pow(ratio, draw()));
    Eigen::VectorXd w(4);
    for (double& share : w) share = draw();
    l.shares.push_back(w.normalized());
  }
  return l;
}

/// 1-norm, from the inverse.
double condition_of(const MatrixXd& K) {
  const Eigen::PartialPivLU<MatrixXd> lu(K);
  return K.cwiseAbs().colwise().sum().maxCoeff() * lu.inverse().cwiseAbs().colwise().sum().maxCoeff();
}

/// A determinant below 0: between one common radius, where it is above, and these radii lies a singular
/// system. By the signs of the pivots: the determinant itself may be too small for a double.
bool has_crossed(const MatrixXd& K) {
  const Eigen::PartialPivLU<MatrixXd> lu(K);
  const Eigen::VectorXd pivots = lu.matrixLU().diagonal();
  return lu.permutationP().determinant() * pivots.cwiseSign().prod() <= 0;
}

void sweep_triple(StabilityReport& report) {
  constexpr double kMostRatio = 10;
  for_each_kernel([&](auto kernel) {
    StabilityRow row{.method = std::string(kernel.kName),
                     .sweep = "support ratio, three landmarks in a line, the paper's rule",
                     .parameter = "ratio",
                     .swept_to = kMostRatio,
                     .kind = "singular"};
    row.at_failure = first_failure(
        1, kMostRatio, [&](double ratio) { return has_crossed(papers_matrix(kernel, triple(ratio))); },
        1e-12);
    if (kernel.kName == Wendland31::kName) row.theory = 11.660167858376596 / 4;
    StabilityCurve curve{row.method, row.sweep, row.parameter, {}};
    for (int k = 0; k <= 60; ++k) curve.at.push_back(std::pow(kMostRatio, k / 60.0));
    if (row.at_failure)  // the peak
      for (const double off : {-1e-2, -1e-4, -1e-6, -1e-8, 0.0, 1e-8, 1e-6, 1e-4, 1e-2})
        curve.at.push_back(*row.at_failure * (1 + off));
    std::ranges::sort(curve.at);
    for (const double ratio : curve.at)
      curve.condition.push_back(condition_of(papers_matrix(kernel, triple(ratio))));
    report.curves.push_back(std::move(curve));
    report.rows.push_back(row);
    row.sweep = "support ratio, three landmarks in a line, the positive definite rule";
    row.theory.reset();
    row.at_failure = first_failure(1, kMostRatio, [&](double ratio) {
      return !(spectrum(definite_matrix(kernel, triple(ratio))).condition() < kSingular);
    });
    report.rows.push_back(row);
  });
}

void sweep_random(StabilityReport& report) {
  const unsigned sets = report.quick ? 50 : 1000, fewer = report.quick ? 20 : 100;
  const std::string which = fmt::format("{} random sets, n to 200, ratio 10", sets);
  for_each_kernel([&](auto kernel) {
    unsigned crossed = 0, singular = 0, indefinite = 0, definite_failed = 0;
    for (unsigned seed = 0; seed < sets; ++seed) {
      const Landmarks l = random_landmarks(seed, 10);
      const MatrixXd K = papers_matrix(kernel, l);
      crossed += has_crossed(K);
      singular += !(condition_of(K) < kSingular);
      indefinite += (K + K.transpose()).eval().llt().info() != Eigen::Success;
      definite_failed += definite_matrix(kernel, l).llt().info() != Eigen::Success;
    }
    StabilityRow row{
        .method = std::string(kernel.kName), .parameter = "share of sets", .kind = "not definite"};
    const auto add = [&](const char* rule, unsigned failed) {
      row.sweep = fmt::format("{}, {}", which, rule);
      row.at_failure = failed ? std::optional(double(failed) / sets) : std::nullopt;
      report.rows.push_back(row);
    };
    add("the paper's rule: xᵀKx < 0 for some x", indefinite);
    add("the paper's rule: determinant below 0", crossed);
    add("the paper's rule: condition above 1e12", singular);
    add("the positive definite rule", definite_failed);
    row.sweep =
        fmt::format("support ratio, {} random sets, n to 200, the paper's rule: determinant below 0", fewer);
    row.parameter = "ratio";
    row.swept_to = 10;
    row.at_failure = first_failure(1.01, 10, [&](double ratio) {
      for (unsigned seed = 0; seed < fewer; ++seed)
        if (has_crossed(papers_matrix(kernel, random_landmarks(seed, ratio)))) return true;
      return false;
    });
    report.rows.push_back(row);
  });
}

}  // namespace

void sweep_support_ratio(StabilityScene& /*scene*/, StabilityReport& report) {
  sweep_triple(report);
  sweep_random(report);
}

}  // namespace brachy
