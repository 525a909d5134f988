#pragma once

#include <functional>
#include <vector>

#include "core/brachytherapy/plan/optimiser/placement_noise.h"
#include "core/brachytherapy/robust/robust_evaluation.h"

namespace brachy {

/// The noise over which a robust plan of seeds is sought, of what it cannot know.
PlacementNoise placement_noise(const UncertaintySettings& settings, const SeedMisplacement& misplacement);

/// The plan with the dwell times that most of the drawn treatments meet all of `goals` with: times that minimise the
/// penalties of optimise_dwell_times over draws, with the weights of the goals that most of them miss raised by and by
/// (those that HdrGoals has, with the limits of `goals`);
/// those are used that meet the goals in most of 192 other draws. `structures` and `dose` as of RobustJudge.
/// Deterministic. Some 20 s on two cores. Errors: UserError as RobustJudge.
HdrPlan with_robust_times(const HdrPlan& plan, const std::vector<Structure>& structures,
                          const TemplateGrid& grid, const DoseSettings& dose,
                          const std::vector<DoseGoal>& goals, const UncertaintySettings& uncertainty,
                          const std::function<void(double share)>& progress = {});

}  // namespace brachy
