#pragma once

#include "core/base/work_budget.h"
#include "core/scene/scene.h"

namespace brachy {

/// How many times the stored WorkCosts a tick's work costs on this machine with the scene's instruction set: the
/// processor time of a fixed count of work, 200 ticks of four needles in the default phantom, over what it takes where
/// the stored costs are from. Takes some seconds. Throws UserError if the scene's engine.simd is not available here.
double measure_work_scale(const Scene& scene);

/// The section of a scene file that gives a tick these costs, each line after `indent`.
std::string work_costs_toml(const WorkCosts& costs, const std::string& indent);

}  // namespace brachy
