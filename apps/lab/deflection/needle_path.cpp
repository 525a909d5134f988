#include "apps/lab/deflection/needle_path.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

#include "core/elasticity/beam.h"
#include "core/elasticity/kelvin.h"

namespace brachy {
namespace {

struct PathPoint {
  double depth_mm, rest_mm;  // along and across
};

// Compliance of the tissue between points across the path; springs are diagonal, by the length that each stands for.
Eigen::MatrixXd tissue_compliance(const NeedlePathSettings& s, const std::vector<PathPoint>& path) {
  const auto n = static_cast<Eigen::Index>(path.size());
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n, n);
  const auto depth = [&](Eigen::Index i) { return path[static_cast<std::size_t>(i)].depth_mm; };
  for (Eigen::Index i = 0; i < n; ++i) {
    if (s.foundation_n_per_mm2 > 0) {
      const double before = i > 0 ? depth(i) - depth(i - 1) : 0,
                   after = i + 1 < n ? depth(i + 1) - depth(i) : 0;
      K(i, i) = 1 / (s.foundation_n_per_mm2 * std::max(0.5 * (before + after), 1e-6));
      continue;
    }
    for (Eigen::Index j = 0; j < n; ++j)
      K(i, j) =
          kelvin(Vec3(0, 0, depth(i) - depth(j)), s.core_mm * s.core_mm, s.poisson)(0, 0) / s.shear_modulus;
  }
  return K;
}

}  // namespace

std::vector<double> needle_path(const NeedlePathSettings& s) {
  const double L = s.needle_length_mm;
  Beam beam{.length_mm = L, .bending_stiffness_nmm2 = s.bending_stiffness_nmm2};
  const auto steps = static_cast<int>(std::lround(s.depth_mm / s.step_mm));
  const auto every = std::max(1, static_cast<int>(std::lround(s.spacing_mm / s.step_mm)));
  std::vector<PathPoint> cut;  // landmarks behind the tip
  std::vector<double> tips;
  double rest = 0, last_slope = 0;
  for (int k = 0; k <= steps; ++k) {
    const double depth = k * s.step_mm;
    beam.guide_mm = L - depth;
    std::vector<PathPoint> path = cut;
    path.push_back({depth, rest});
    const auto n = static_cast<Eigen::Index>(path.size());
    Eigen::MatrixXd K = tissue_compliance(s, path);
    Eigen::VectorXd d(n);
    const auto arc = [&](Eigen::Index i) { return L - depth + path[static_cast<std::size_t>(i)].depth_mm; };
    for (Eigen::Index i = 0; i < n; ++i) {
      d[i] = beam.compliance(arc(i), L) - path[static_cast<std::size_t>(i)].rest_mm;
      for (Eigen::Index j = 0; j < n; ++j) K(i, j) += beam.compliance(arc(i), arc(j));
    }
    const Eigen::VectorXd f = K.llt().solve(d);
    double tip = beam.compliance(L, L), slope = beam.slope_compliance(L, L);
    for (Eigen::Index i = 0; i < n; ++i) {
      tip -= f[i] * beam.compliance(L, arc(i));
      slope -= f[i] * beam.slope_compliance(L, arc(i));
    }
    tips.push_back(tip);
    if (k % every == 0) cut.push_back({depth, rest});
    rest += s.step_mm * 0.5 * (slope + (k > 0 ? last_slope : slope));
    last_slope = slope;
  }
  return tips;
}

}  // namespace brachy
