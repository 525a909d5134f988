#pragma once

#include <vector>

#include "core/brachytherapy/plan/request/make_plan.h"
#include "core/scene/scene.h"

namespace brachy {

/// `brachy plan --strengths`: plans as requested but for the strength, one of each, and prints a table or, as `json`,
/// an array: needles, seeds, figures and goals, or why there is none. Returns an exit code: kExitRefused where there
/// is none of any strength.
int compare_strengths(const std::vector<double>& strengths_u, PlanRequest request,
                      const std::vector<Structure>& structures, const Scene& scene, bool json);

}  // namespace brachy
