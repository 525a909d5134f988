#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/score/dose_score.h"
#include "core/brachytherapy/dose/dose_goal.h"

namespace brachy {

/// A goal and what became of it.
struct GoalResult {
  DoseGoal goal;
  double value =
      0;  ///< in the figure's unit; kNoNumber: the scene has no such structure, or nothing is known
  double limit = 0;  ///< the same unit
  std::optional<bool> is_met;
};

/// Goals of the plan by DoseScore::plan, of the implant by DoseScore::rest.
std::vector<GoalResult> judge(const std::vector<DoseGoal>& goals, const DoseScore& dose);

/// "the plan meets its goals; the implant misses 2 of its 8: prostate D90, urethra D30".
std::string verdict(const std::vector<GoalResult>& results);

/// "prostate V100 86.2 %, under its limit of 90"; of a missed one.
std::string missed_text(const GoalResult& result);

}  // namespace brachy
