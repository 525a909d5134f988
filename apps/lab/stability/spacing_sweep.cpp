// Landmark spacing against support: the law of the least eigenvalue (core/kernels/eigenvalue_law.h), where the system's
// condition passes 1e12, where factorization fails and where landmarks are missed, in double.
#include <fmt/format.h>

#include <cmath>

#include "apps/lab/stability/landmark_systems.h"
#include "apps/lab/stability/sweeps.h"
#include "core/solve/rbf_system.h"

namespace brachy {
namespace {

constexpr double kSupports[] = {8, 16, 32, 64};  // a/q of the laws of core/DESIGN.md, section 4

/// The constant c of λmin = c (q/a)^p: of the four supports' the one farthest from that of core/DESIGN.md, section 4.
void measure_laws(StabilityReport& report) {
  const std::size_t per_side = report.quick ? 6 : 10;
  const struct {
    double EigenvalueLaw::*constant;
    std::string name;
    std::vector<Vec3> points;
  } sets[] = {
      {&EigenvalueLaw::on_shaft, "shaft of 41", unit_shaft(41)},
      {&EigenvalueLaw::on_cubic_grid, fmt::format("cubic grid of {0}³", per_side), unit_grid(per_side)},
      {&EigenvalueLaw::on_jittered_grid, fmt::format("jittered grid of {0}³", per_side),
       jittered_grid(per_side)}};
  for (const auto& set : sets) {
    const double q = least_spacing(set.points);
    for_each_kernel([&](auto kernel) {
      const EigenvalueLaw law = kernel.kEigenvalueLaw;
      const double by_law = law.*set.constant;
      StabilityCurve curve{std::string(kernel.kName), "landmark spacing, " + set.name, "a/q", {}};
      double farthest = by_law;
      for (const double a_over_q : kSupports) {
        const Spectrum eigenvalues = spectrum(psi_matrix(kernel, a_over_q * q, set.points));
        const double constant = eigenvalues.least * std::pow(a_over_q, law.power);
        if (std::abs(std::log(constant / by_law)) > std::abs(std::log(farthest / by_law)))
          farthest = constant;
        curve.at.push_back(a_over_q);
        curve.condition.push_back(eigenvalues.condition());
      }
      report.rows.push_back(
          {.method = curve.method,
           .sweep = fmt::format("least eigenvalue × (a/q)^{}, {}, a/q = 8 … 64", law.power, set.name),
           .parameter = "constant",
           .at_failure = farthest,
           .kind = "law",
           .theory = by_law});
      if (set.constant == &EigenvalueLaw::on_jittered_grid && !report.quick)
        report.rows.push_back({.method = curve.method,
                               .sweep = "condition at a/q = 64, " + set.name,
                               .parameter = "condition",
                               .at_failure = curve.condition.back(),
                               .kind = "law",
                               .theory = law.condition_of_1000});
      report.curves.push_back(std::move(curve));
    });
  }
}

/// 0.3 mm at cores of 2.5 mm: 6e11 on a line long enough.
void measure_elastic(const StabilityScene& scene, StabilityReport& report) {
  const SystemFamily line = core_line(scene.body(), 67);
  report.rows.push_back({.method = line.method,
                         .sweep = "condition at spacing 0.12 core, " + line.landmarks,
                         .parameter = "condition",
                         .at_failure = spectrum(*line.matrix(0.12)).condition(),
                         .kind = "law",
                         .theory = 6e11});
}

/// Two landmarks at decreasing distance: below 1e-6 a the engine refuses them by index (core/DESIGN.md, section 4).
void sweep_duplicates(StabilityReport& report) {
  for_each_kernel([&](auto kernel) {
    const auto is_refused = [&](double a_over_q) {
      RbfSystem system(kernel, 1, 2);
      const Vec3 pair[] = {Vec3::Zero(), Vec3(0, 0, 1 / a_over_q)};
      return !system.factorize(pair);
    };
    report.rows.push_back({.method = std::string(kernel.kName),
                           .sweep = "landmark spacing, two landmarks",
                           .parameter = "a/q",
                           .at_failure = first_failure(1e3, 1e9, is_refused, 1e-6),
                           .swept_to = 1e9,
                           .kind = "refused",
                           .theory = 1e6});
  });
}

void sweep_family(const SystemFamily& family, StabilityReport& report) {
  std::optional<double> singular_by_theory;
  if (family.condition_by_theory)
    singular_by_theory = first_failure(
        family.from, family.to, [&](double v) { return family.condition_by_theory(v) > kSingular; }, 1e-3);
  const auto add = [&](const char* kind, std::optional<double> theory, const auto& fails) {
    const auto judge = [&](double value) {
      const auto K = family.matrix(value);
      return !K || fails(*K);
    };
    report.rows.push_back({.method = family.method,
                           .sweep = "landmark spacing, " + family.landmarks,
                           .parameter = family.parameter,
                           .at_failure = first_failure(family.from, family.to, judge),
                           .swept_to = family.to,
                           .kind = kind,
                           .theory = theory});
  };
  add("singular", singular_by_theory,
      [](const Eigen::MatrixXd& K) { return !(spectrum(K).condition() < kSingular); });
  if (family.is_definite)
    add("not definite", std::nullopt,
        [](const Eigen::MatrixXd& K) { return !solve_in<double>(K, true).has_factor; });
  add("inaccurate", std::nullopt,
      [&](const Eigen::MatrixXd& K) { return !(solve_in<double>(K, family.is_definite).missed < kMissed); });
  StabilityCurve curve{family.method, "landmark spacing, " + family.landmarks, family.parameter, {}};
  const double end = report.rows.back().at_failure.value_or(family.to);
  for (int k = 0; k <= 12; ++k) {
    const double value = family.from * std::pow(end / family.from, k / 12.0);
    const auto K = family.matrix(value);
    if (!K) break;
    curve.at.push_back(value);
    curve.condition.push_back(spectrum(*K).condition());
    if (family.condition_by_theory) curve.condition_by_theory.push_back(family.condition_by_theory(value));
  }
  report.curves.push_back(std::move(curve));
}

}  // namespace

void sweep_spacing(StabilityScene& scene, StabilityReport& report) {
  measure_laws(report);
  measure_elastic(scene, report);
  sweep_duplicates(report);
  for (const SystemFamily& family : system_families(scene)) sweep_family(family, report);
}

}  // namespace brachy
