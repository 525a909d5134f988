// Poisson's ratio towards ½, where finite elements of low order lock (they grow stiff) and kernels that are not made of
// divergence-free parts keep changing volume. The measure of the first is the force that holds a shaft displaced
// by 1 mm, fem's against elastic's; of the second, div u over |∇u|, root mean squares over the tissue round the
// shaft.
#include <algorithm>
#include <cmath>
#include <map>

#include "apps/lab/comparators/mass_spring.h"
#include "apps/lab/stability/landmark_systems.h"
#include "apps/lab/stability/pushed_methods.h"
#include "apps/lab/stability/sweeps.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/models/matrix_kernel/matrix_models.h"

namespace brachy {
namespace {

struct Held {
  double force;           // N for 1 mm
  double volume_changed;  // div u over |∇u|
};

Held hold_shaft(const std::string& model_name, const StabilityScene& scene, double poisson) {
  ElasticBody body = scene.body();
  body.poisson = poisson;
  const auto kernel = make_matrix_kernel(model_name, body);
  const PushedLandmarks shaft = pushed_shaft(scene.middle(), 5, scene.landmark_spacing(), Vec3::UnitX());
  MatrixKernelSystem system(*kernel);
  if (!system.factorize(shaft.positions)) return {};
  Vec3 force = Vec3::Zero();
  for (const Vec3& f : system.solve(shaft.directions)) force += f;
  std::vector<Vec3> tissue;
  for (const Vec3& cell : unit_grid(12)) {
    const Vec3 X = 40.0 / 12 * (cell - Vec3::Constant(5.5));
    if (X.head<2>().norm() > 3 * body.needle_radius) tissue.push_back(scene.middle() + X);
  }
  double divergence2 = 0, gradient2 = 0;
  for (const Mat3& gradient : matrix_gradients(*kernel, shaft)(tissue)) {
    divergence2 += gradient.trace() * gradient.trace();
    gradient2 += gradient.squaredNorm();
  }
  return {force.norm(), std::sqrt(divergence2 / gradient2)};
}

/// λ/2(λ + μ) of the springs: stretched along x alone, the stress across over the sum of both.
double ratio_of_springs() {
  const Lattice lattice(Vec3::Zero(), Vec3::Constant(16), 4);
  SpringLattice springs(lattice, [](const Vec3&) { return 1e-3; });
  for (std::size_t node = 0; node < lattice.size(); ++node)
    springs.prescribe(node, Vec3(0.01 * lattice.position(node).x(), 0, 0));
  double along = 0, across = 0;
  for (std::size_t node = 0; node < lattice.size(); ++node) {
    const auto place = lattice.place(node);
    if (place[0] == 4) along += springs.spring_force(node).x();
    if (place[1] == 4) across += springs.spring_force(node).y();
  }
  return across / (along + across);
}

}  // namespace

void sweep_poisson(StabilityScene& scene, StabilityReport& report) {
  constexpr double kMost = 0.4995;  // that a scene may have
  constexpr double kStiffer = 1.1, kVolume = 0.1;
  const std::vector<double> ratios =
      scene.is_quick() ? std::vector{0.25, 0.49, kMost}
                       : std::vector{0.0, 0.1, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.49, 0.499, kMost};
  const std::vector<std::string> models = scene.models();
  std::map<std::string, std::vector<Held>> held;
  for (const std::string& model_name : models)
    for (const double poisson : ratios) held[model_name].push_back(hold_shaft(model_name, scene, poisson));
  for (const std::string& model_name : models) {
    // made independently of each other
    const std::string other = model_name == "elastic" ? "fem" : "elastic";
    if (!held.contains(other)) continue;
    const auto first = [&](const auto& fails) {
      std::optional<double> found;
      for (std::size_t i = 0; i < ratios.size() && !found; ++i)
        if (fails(held[model_name][i], held[other][i])) found = ratios[i];
      return found;
    };
    if (model_name == "elastic" || model_name == "fem")
      report.rows.push_back(
          {.method = model_name,
           .sweep = "Poisson's ratio: force on a shaft over 1.1 times that of " + other,
           .parameter = "ν",
           .at_failure = first([](const Held& h, const Held& o) { return !(h.force < kStiffer * o.force); }),
           .swept_to = kMost,
           .kind = "locking"});
    report.rows.push_back({.method = model_name,
                           .sweep = "Poisson's ratio: div u/|∇u| over 0.1 more than that of " + other,
                           .parameter = "ν",
                           .at_failure = first([](const Held& h, const Held& o) {
                             return !(h.volume_changed < o.volume_changed + kVolume);
                           }),
                           .swept_to = kMost,
                           .kind = "inaccurate"});
  }
  report.rows.push_back({.method = "mass_spring",
                         .sweep = "Poisson's ratio, which it has by itself",
                         .parameter = "ν",
                         .at_failure = ratio_of_springs(),
                         .swept_to = kMost,
                         .kind = "fixed",
                         .theory = 0.25});
}

}  // namespace brachy
