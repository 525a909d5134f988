#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/plan/plan.h"

namespace brachy {

struct Score;

/// A mistake in a session.
struct Finding {
  std::string text;   ///< one sentence for the instructor
  double weight = 0;  ///< how much it matters: misplaced seeds times mm, or the like
};

/// What went wrong, the heaviest first; none of a session as planned. Structures entered come first. A needle's seeds
/// off their hole, seeds that are missing, and what all seeds have in common (a shift along or across, a scatter) are
/// weighed by seeds times mm, a missing seed by SeedAssignment::kFarthestMm, a puncture too many like half a seed.
/// The limits stand in findings.cpp.
std::vector<Finding> find_mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid);

}  // namespace brachy
