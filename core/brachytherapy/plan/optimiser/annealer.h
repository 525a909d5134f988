#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/brachytherapy/plan/optimiser/needle_choices.h"
#include "core/brachytherapy/plan/optimiser/plan_dose.h"

namespace brachy {

/// How long to anneal, and within what.
struct AnnealingSettings {
  std::uint64_t seed = 1;
  std::size_t proposals = 300'000;
  double first_temperature = 0.5, last_temperature = 0.002;  ///< in units of the objective
  std::size_t most_needles = 25, most_seeds = 90, most_seeds_a_needle = NeedleLoad::kMostElements;
  double per_needle = 0, per_seed = 0;  ///< PlanObjective's
};

/// A choice of loads and what it costs.
struct Annealed {
  std::vector<NeedleLoad> loads;  ///< of all choices
  double objective = 0;
};

/// Simulated annealing (Kirkpatrick, Gelatt, Vecchi, Science 220, 1983, 671–680) of needles, depths and trains:
/// proposals move a needle deeper or shallower or to a hole near by, change, add, drop or exchange elements of a train,
/// insert a needle or take one out; each is accepted by Metropolis' rule while the temperature falls geometrically.
/// Returns the best that it saw. Deterministic: the same settings give the same bits on any machine and thread.
/// `start`: of all choices; a needle that it does not hold (NeedleChoice::holds) must not be in it.
/// `progress`, if any, is called about every hundredth of the way.
Annealed anneal(const std::vector<NeedleChoice>& choices, std::vector<NeedleLoad> start, PlanDose& dose,
                const AnnealingSettings& settings, const std::function<void(double share)>& progress = {});

}  // namespace brachy
