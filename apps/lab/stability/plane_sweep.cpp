// Where a ψ kernel fails in the plane of spacing / support and push / support: a shaft one support and a half long,
// pushed along itself as a whole, or its tip alone with the other landmarks held; and, whatever the push, the
// spacings at which its system is singular in double and misses landmarks in single precision.
#include <cmath>

#include "apps/lab/stability/landmark_systems.h"
#include "apps/lab/stability/pushed_methods.h"
#include "apps/lab/stability/sweeps.h"

namespace brachy {
namespace {

constexpr double kLength = 1.5, kMostPlanePush = 4;  // supports

PlaneBorder fold_border(const PushedMethod& method, bool tip_alone, double support, bool is_quick) {
  PlaneBorder border{method.name, tip_alone ? "tip alone" : "whole shaft", "fold", {}, {}};
  for (const double a_over_q : is_quick
                                   ? std::vector<double>{2, 4, 8, 16, 32}
                                   : std::vector<double>{1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64}) {
    const auto n = static_cast<std::size_t>(kLength * a_over_q) + 1;
    PushedLandmarks shaft = pushed_shaft(Vec3::Zero(), n, support / a_over_q, Vec3::UnitZ());
    if (tip_alone)
      for (std::size_t i = 1; i < n; ++i) shaft.directions[i].setZero();
    const PushedField field = method.field(shaft);
    const auto push = field ? field.fold(kMostPlanePush * support) : 0.0;
    if (!push) continue;
    border.spacing.push_back(1 / a_over_q);
    border.push.push_back(*push / support);
  }
  return border;
}

}  // namespace

void sweep_plane(StabilityScene& scene, StabilityReport& report) {
  for (const PushedMethod& method : psi_methods(scene.support())) {
    for (const bool tip_alone : {false, true})
      report.plane.push_back(fold_border(method, tip_alone, scene.support(), scene.is_quick()));
    const Kernel kernel = *find_kernel(method.name);
    const auto system = [&](double a_over_q) {
      return psi_matrix(kernel, a_over_q, unit_shaft(static_cast<std::size_t>(kLength * a_over_q) + 1));
    };
    // Landmarks grow in number here, and eigenvalues cost their cube.
    const double most = scene.is_quick() ? 100 : 300;
    const auto singular =
        first_failure(4, most, [&](double r) { return !(spectrum(system(r)).condition() < kSingular); });
    const auto missed = first_failure(
        4, most, [&](double r) { return !(solve_in<float>(system(r), true).missed < kMissed); });
    if (singular) report.plane.push_back({method.name, "", "singular", {1 / *singular}, {}});
    if (missed)
      report.plane.push_back({method.name, "", "inaccurate in single precision", {1 / *missed}, {}});
  }
}

}  // namespace brachy
