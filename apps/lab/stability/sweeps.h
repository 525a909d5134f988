#pragma once

#include <span>

#include "apps/lab/stability/stability_report.h"
#include "apps/lab/stability/stability_scene.h"

namespace brachy {

// One function per family of sweeps, each in its own file, which cites the theory; they add their rows, curves and
// borders to `report`. `report.quick`: fewer and smaller cases.

/// Push depth over support: one landmark, a shaft, a contact beside anchors.
void sweep_push(StabilityScene& scene, StabilityReport& report);
/// The border of folds in the plane of spacing / support and push / support.
void sweep_plane(StabilityScene& scene, StabilityReport& report);
/// An anchor beside a needle's path: the push at which it folds the field.
void sweep_anchor(StabilityScene& scene, StabilityReport& report);
/// Landmark spacing over support: condition, the factor, landmarks missed.
void sweep_spacing(StabilityScene& scene, StabilityReport& report);
/// The same in single precision.
void sweep_precision(StabilityScene& scene, StabilityReport& report);
/// Support radii that differ: the paper's rule and the positive definite one.
void sweep_support_ratio(StabilityScene& scene, StabilityReport& report);
/// Poisson's ratio towards ½.
void sweep_poisson(StabilityScene& scene, StabilityReport& report);
/// The time step of the mass-spring lattice.
void sweep_time_step(StabilityScene& scene, StabilityReport& report);
/// Consequences of a lattice: landmarks beside its nodes, the order in which they are given.
void sweep_lattice(StabilityScene& scene, StabilityReport& report);
/// Landmarks that nearly lie in a plane.
void sweep_coplanar(StabilityScene& scene, StabilityReport& report);

struct Sweep {
  const char* name;
  void (*run)(StabilityScene& scene, StabilityReport& report);
  double weight;  ///< relative run time: approximate seconds on one core
};
/// All of the above. To add one: a file, and a line in sweeps.cpp.
std::span<const Sweep> all_sweeps();

}  // namespace brachy
