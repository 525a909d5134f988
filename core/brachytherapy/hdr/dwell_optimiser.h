#pragma once

#include <span>
#include <vector>

#include "core/brachytherapy/hdr/dwell_doses.h"

namespace brachy {

/// Quadratic penalties on the doses of one kind of structure, shares of the prescription: weight × mean of the squared
/// shortfall below `least`, and of the excess above `most`.
struct DwellPenalty {
  DosePoints::Role role;
  double least = 0, least_weight = 0;
  double most = 0, most_weight = 0;
};

/// Penalties that lead to HdrGoals on most glands; optimise_dwell_times changes their weights.
std::vector<DwellPenalty> default_penalties();

/// Dwell times t ≥ 0, s, that minimise the sum of the penalties over all of `doses`, which are of the same dwells: a
/// convex piecewise quadratic function. By Nesterov's projected gradient with restarts (Beck, Teboulle, SIAM J. Imaging
/// Sci. 2, 2009, 183–202; O'Donoghue, Candès, Found. Comput. Math. 15, 2015, 715–732), from `start`. The penalty form
/// is that of inverse planning (Lessard, Pouliot, Med. Phys. 28, 2001, 773–779), with squares in place of lines.
/// Deterministic.
std::vector<double> minimise_penalties(std::span<const DwellDoses> doses,
                                       const std::vector<DwellPenalty>& penalties, std::vector<double> start,
                                       int iterations);

/// The same time everywhere, such that the target's mean dose is a little above the prescription.
std::vector<double> even_times(const DwellDoses& doses);
/// Gives a plan's dwell positions these times, catheter by catheter, in each from the tip backwards.
void set_times(HdrPlan& plan, const std::vector<double>& seconds);
/// In steps of 0.1 s, as afterloaders have.
std::vector<double> rounded_times(std::vector<double> seconds);

/// Dwell times for HdrGoals: minimises the penalties, raises the weights of the goals that are missed, and again, at
/// most kRounds times; returns the times that miss the goals, with a margin of 1 %, least, rounded.
/// Deterministic; 0.3 s for 150 positions.
std::vector<double> optimise_dwell_times(const DwellDoses& doses);
inline constexpr int kRounds = 12;
inline constexpr double kDwellStepS = 0.1;

}  // namespace brachy
