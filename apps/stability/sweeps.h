#pragma once

#include "apps/stability/stability_report.h"
#include "apps/stability/stability_scene.h"

namespace brachy {

// One function a family of sweeps, each in a file of its own; they add their rows, curves and borders to `report`.

/// Push depth over support: one landmark, a shaft, a contact beside anchors; and the borders in the plane of spacing and push.
void sweep_push(StabilityScene& scene, StabilityReport& report);
/// An anchor beside a needle's path: the push at which it folds the field.
void sweep_anchor(StabilityScene& scene, StabilityReport& report);
/// Landmark spacing over support: condition, the factor, landmarks missed.
void sweep_spacing(StabilityScene& scene, StabilityReport& report);
/// The same in single precision.
void sweep_precision(StabilityScene& scene, StabilityReport& report);
/// Support radii that differ: the paper's rule and the positive definite one.
void sweep_support_ratio(const StabilityScene& scene, StabilityReport& report);
/// Poisson's ratio towards ½.
void sweep_poisson(const StabilityScene& scene, StabilityReport& report);
/// The time step of what moves by time steps.
void sweep_time_step(const StabilityScene& scene, StabilityReport& report);
/// The order in which landmarks are given.
void sweep_order(const StabilityScene& scene, StabilityReport& report);

/// All of them.
StabilityReport run_sweeps(const Scene& scene, bool is_quick);

}  // namespace brachy
