#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/brachytherapy/plan/optimiser/needle_choices.h"
#include "core/brachytherapy/plan/optimiser/placement_noise.h"
#include "core/brachytherapy/plan/optimiser/plan_objective.h"
#include "core/brachytherapy/plan/plan_generator.h"

namespace brachy {

/// How to look for a plan.
struct OptimiserSettings {
  double strength_u = 0.5;  ///< of each seed: given, not chosen
  std::uint64_t seed = 1;
  std::size_t proposals = 450'000;      ///< of each chain
  std::size_t chains = 2, threads = 2;  ///< the best chain is used; threads change the time, not the plan
  std::size_t most_needles = 0;         ///< 0: 25, beyond 50 cc in proportion to the gland's surface
  std::size_t most_seeds = 0;  ///< 0: 90, beyond 50 cc in proportion to the volume; never above PlanSettings
  std::size_t most_seeds_a_needle = NeedleLoad::kMostElements;
  std::vector<std::string> forbidden_holes;  ///< no needle is put through them
  /// Needles that stay as they are, through whatever hole and however deep, of `strength_u`; the limits above count
  /// them. Over draws of the noise they lie as planned.
  Plan kept;
  NeedleClearances clearances;
  PlanPointCounts points;
  PlanObjective objective = PlanObjective::standard();
  bool robust = false;  ///< also over the draws of `noise`, from there; see make_robust()
  PlacementNoise noise;
  std::size_t robust_proposals = 25'000;

  /// `robust`, with the objective that allows for it (PlanObjective::with_margin).
  void make_robust() {
    robust = true;
    proposals = 120'000;
    objective = PlanObjective::with_margin();
  }
};

/// A plan and how it was found.
struct OptimisedPlan {
  Plan plan;
  double objective = 0;  ///< penalties and counts, at the optimiser's own points
  bool urethra_assumed = false;
};

/// Chooses holes, depths and trains for the gland, `structures.front()`, with seeds of the given strength: simulated
/// annealing from an empty template over PlanObjective (README.md). Without a "urethra" one is assumed
/// (with_urethra). The plan has `how.kept` and what is chosen around it. Deterministic: the same settings give the same
/// plan on every machine.
/// Errors: UserError as find_needle_choices, and where no hole is left; and where no seed reaches the gland.
/// `progress`, if any, is called with the share done, from this thread.
/// Not real-time. Some 3 s, two threads; robust some more.
OptimisedPlan optimise_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                            const PlanSettings& settings, const OptimiserSettings& how,
                            const std::function<void(double share)>& progress = {});

/// The plan with those needles only that are still to be put in: none that a placed seed is of, by its number in the
/// plan (Plan::seeds) where `planned` has one that is ≥ 0, else by the hole through which it lies.
Plan remaining_needles(const Plan& plan, const TemplateGrid& grid, const std::vector<DoseSeed>& placed,
                       const std::vector<std::int32_t>& planned);

/// What is left to do: the plan's needles that are not in yet, for an implant whose other seeds lie where they lie.
/// Chooses holes, depths and trains of `remaining` again, with no more needles than it has, given the dose of `placed`.
/// Under 1 s with replan_settings(). Errors: as optimise_plan.
OptimisedPlan replan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                     const Plan& remaining, const std::vector<DoseSeed>& placed, double needle_length_mm,
                     const OptimiserSettings& how);
OptimiserSettings replan_settings(std::uint64_t seed = 1);

/// The needles and seeds that a gland may have at most: what `how` says, or what is customary.
std::size_t most_needles_for(double volume_cc, const OptimiserSettings& how);
std::size_t most_seeds_for(double volume_cc, const OptimiserSettings& how);

/// The structures with a "urethra": where there is none, a straight one of 3 mm radius along z through the middle of
/// the gland's box, and `assumed` says so.
std::vector<Structure> with_urethra(const std::vector<Structure>& structures, bool& assumed);

}  // namespace brachy
