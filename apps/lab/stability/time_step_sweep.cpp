// The time step of the mass-spring lattice, which is explicit. Theory, by von Neumann: a mode of frequency ω grows once
// dt² ω² > 2 (2 + c dt), c the damping (semi-implicit Euler with v ← (v + dt a)/(1 + c dt)); ω² is the largest
// eigenvalue of Σ k n nᵀ (1 − cos q·δ) · 2/m over a node's springs k, n, δ and all wave vectors q.
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "apps/lab/comparators/mass_spring.h"
#include "apps/lab/stability/landmark_systems.h"
#include "apps/lab/stability/sweeps.h"

namespace brachy {
namespace {

constexpr double kSpacing = 8;  // mm; the limit over largest_step() does not depend on it

/// ω² of the highest mode of an unbounded cubic lattice, 1/s².
double highest_mode(double modulus) {
  const double k = modulus * kSpacing, mass = SpringLattice::kDensity * std::pow(kSpacing, 3);
  double highest = 0;
  for (const Vec3& corner : unit_grid(9)) {
    const Vec3 q = std::numbers::pi / 8 * corner;
    Mat3 D = Mat3::Zero();
    for (const Vec3& to : unit_grid(3)) {
      const Vec3 delta = to - Vec3::Ones();
      const double length2 = delta.squaredNorm();
      if (length2 == 0 || length2 == 3) continue;  // itself; there are no diagonals through a cell
      D += k * (1 - std::cos(q.dot(delta))) / length2 * (delta * delta.transpose());
    }
    highest = std::max(highest, D.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff() / mass);
  }
  return highest;
}

/// Whether steps of `factor` times the limit diverge: one node is pushed by 1 mm, and a displacement exceeds any that
/// the push can cause.
bool diverges(const Lattice& lattice, double modulus, const ElasticBody& body, double factor) {
  constexpr int kSteps = 400;
  SpringLattice springs(lattice, [=](const Vec3&) { return modulus; });
  for (std::size_t node = 0; node < lattice.size(); ++node)
    if (lattice.is_held(node, body)) springs.prescribe(node, Vec3::Zero());
  springs.prescribe(lattice.nearest(body.box_centre), Vec3::UnitZ());
  for (int step = 0; step < kSteps; ++step) springs.step(factor * springs.largest_step());
  for (const auto& plane : springs.displacements())
    for (const float u : plane)
      if (!(std::abs(u) < 10)) return true;
  return false;
}

}  // namespace

void sweep_time_step(StabilityScene& scene, StabilityReport& report) {
  const ElasticBody& body = scene.body();
  const Lattice lattice(body.box_centre, body.box_size, kSpacing);
  const SpringLattice springs(lattice, [&](const Vec3&) { return body.shear_modulus; });
  const double omega2 = highest_mode(body.shear_modulus), c = springs.damping();
  report.rows.push_back(
      {.method = "mass_spring",
       .sweep = "time step over the step taken",
       .parameter = "ratio",
       .at_failure = first_failure(
           0.9, 10, [&](double factor) { return diverges(lattice, body.shear_modulus, body, factor); }, 1e-3),
       .swept_to = 10,
       .kind = "diverges",
       .theory = (c + std::sqrt(c * c + 4 * omega2)) / omega2 / springs.largest_step()});
}

}  // namespace brachy
