// Landmarks that nearly lie in a plane, whose affine part across it nothing but their unevenness determines: the
// thin-plate spline follows it far out of the plane. (The multiquadric has a constant part only.) Below 1e-6 of the
// spread the comparator leaves the direction out (global_spline.cpp), so the sweep ends there.
#include "apps/lab/comparators/global_spline.h"
#include "apps/lab/stability/landmark_systems.h"
#include "apps/lab/stability/sweeps.h"

namespace brachy {
namespace {

/// The largest displacement within 20 mm of a plane of 5 × 5 landmarks, one push of 1 mm each up or down, that are
/// uneven by ± `uneven` mm.
double overshoot(const SplineBasis& basis, double uneven) {
  constexpr double kSpacing = 5;
  std::vector<Vec3> positions, X;
  Eigen::VectorXd d(25);
  for (int i = 0; i < 25; ++i) {
    const int up = i * i % 3 == 0 ? 1 : -1, pushed = i * i % 5 < 2 ? 1 : -1;
    const int column = i % 5 - 2, row = i / 5 - 2;
    positions.emplace_back(kSpacing * column, kSpacing * row, up * uneven);
    d[i] = pushed;
    for (const double height : {-20.0, -10.0, 10.0, 20.0})
      X.emplace_back(positions.back().x(), positions.back().y(), height);
  }
  return (SplineMap(basis, positions, positions.size()).influence(X) * d).lpNorm<Eigen::Infinity>();
}

}  // namespace

void sweep_coplanar(StabilityScene& scene, StabilityReport& report) {
  constexpr double kTimesPush = 10;
  const auto sweep = [&](const char* name, const SplineBasis& basis) {
    report.rows.push_back(
        {.method = name,
         .sweep = "unevenness of 5 × 5 landmarks in a plane: u over 10 pushes, 20 mm from it",
         .parameter = "mm",
         .at_failure =
             first_failure(2, 1e-4, [&](double uneven) { return overshoot(basis, uneven) > kTimesPush; }),
         .swept_to = 1e-4,
         .kind = "overshoot"});
  };
  sweep("thin_plate", SplineBasis::thin_plate());
  sweep("multiquadric", SplineBasis::multiquadric(scene.body().needle_radius));
}

}  // namespace brachy
