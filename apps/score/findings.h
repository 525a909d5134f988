#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/plan/plan.h"

namespace brachy {

struct Score;
class NeedleCosts;

/// A mistake in a session.
struct Finding {
  std::string text;          ///< one sentence for the instructor, with what the mistake cost
  double weight = 0;         ///< how much it matters beside its dose: misplaced seeds times mm, or the like
  double harm_percent = 0;   ///< DoseChange::harm_percent of the needles or seeds that it is about
  bool is_of_organ = false;  ///< a needle was where it should not be: first, whatever the dose
};

/// What went wrong; none of a session as planned. Organs entered come first, then what harmed the dose, the most
/// harmful first, then the rest by weight: a needle's seeds off their hole or at another depth, seeds that are
/// missing or lost, and what all seeds have in common (a shift along or across, a scatter) by seeds times mm, a
/// missing seed by SeedAssignment::kFarthestMm, a puncture too many like half a seed. The limits stand in
/// findings.cpp. Goals that the plan meets and the implant misses are told with the most harmful mistake. `costs`:
/// of the score's implant; null where its seeds are not known.
std::vector<Finding> find_mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid,
                                   const NeedleCosts* costs);

}  // namespace brachy
