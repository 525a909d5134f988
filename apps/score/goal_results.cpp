#include "apps/score/goal_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/score/spread.h"

namespace brachy {
namespace {

std::string verdict_of(const std::vector<GoalResult>& results, bool of_plan) {
  std::size_t known = 0, missed = 0;
  std::string names;
  for (const GoalResult& result : results) {
    if (result.goal.is_of_plan() != of_plan || !result.is_met) continue;
    ++known;
    if (*result.is_met) continue;
    ++missed;
    names += (names.empty() ? "" : ", ") + result.goal.structure + " " + result.goal.figure;
  }
  const char* who = of_plan ? "the plan" : "the implant";
  if (known == 0) return fmt::format("{} is not judged", who);
  if (missed == 0) return fmt::format("{} meets its {} goals", who, known);
  return fmt::format("{} misses {} of its {} goals: {}", who, missed, known, names);
}

}  // namespace

std::vector<GoalResult> judge(const std::vector<DoseGoal>& goals, const DoseScore& dose) {
  std::vector<GoalResult> results;
  for (const DoseGoal& goal : goals) {
    GoalResult result{goal,
                      goal.value_in((goal.is_of_plan() ? dose.plan : dose.rest).structures),
                      goal.limit_for(dose.prescription_gy),
                      {}};
    if (std::isfinite(result.value)) result.is_met = goal.is_met_by(result.value, dose.prescription_gy);
    results.push_back(std::move(result));
  }
  return results;
}

std::string verdict(const std::vector<GoalResult>& results) {
  return verdict_of(results, true) + "; " + verdict_of(results, false);
}

std::string missed_text(const GoalResult& result) {
  const DoseIndex* index = find_dose_index(result.goal.figure);
  return fmt::format("{} {} {:.1f} {}, {} its limit of {:.4g}", result.goal.structure, result.goal.figure,
                     result.value, index ? unit_text(index->unit) : "",
                     result.goal.is_above() ? "under" : "over", result.limit);
}

}  // namespace brachy
