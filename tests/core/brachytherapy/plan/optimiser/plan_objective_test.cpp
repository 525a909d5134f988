#include "core/brachytherapy/plan/optimiser/plan_objective.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace brachy {
namespace {

using Side = PenaltyTerm::Side;

PlanPoints points_of(std::size_t gland, std::size_t urethra) {
  PlanPoints points;
  for (const auto& [name, count] : {std::pair("gland", gland), std::pair("urethra", urethra)}) {
    PlanPoints::Part part{name, points.points.size(), count, 10};
    points.points.resize(part.first + part.padded());
    points.parts.push_back(part);
  }
  return points;
}

double of(const std::vector<PenaltyTerm>& terms, const PlanPoints& points, const std::vector<float>& dose) {
  PlanObjective objective;
  objective.terms = terms;
  return PointObjective(objective, points).of(dose.data());
}

TEST(PlanObjective, APenaltyIsTheMeanDistanceBeyondTheThreshold) {
  const PlanPoints points = points_of(4, 2);
  std::vector<float> dose(points.points.size(), 7);  // the padding does not count
  const std::vector<float> gland = {0.5f, 0.9f, 1.0f, 2.0f}, urethra = {1.0f, 1.5f};
  std::ranges::copy(gland, dose.begin());
  std::ranges::copy(urethra, dose.begin() + 16);
  EXPECT_NEAR(of({{"prostate", Side::kBelow, 1.0, 0, 3, 0, 0, 0}}, points, dose), 3 * (0.5 + 0.1) / 4, 1e-6);
  EXPECT_NEAR(of({{"prostate", Side::kAbove, 1.5, 0, 2, 0, 0, 0}}, points, dose), 2 * 0.5 / 4, 1e-6);
  EXPECT_NEAR(of({{"urethra", Side::kAbove, 1.25, 0, 1, 0, 0, 0}}, points, dose), 0.25 / 2, 1e-6);
  EXPECT_EQ(of({{"rectum", Side::kAbove, 0.1, 0, 1, 0, 0, 0}}, points, dose), 0);
}

TEST(PlanObjective, ACappedPenaltyIsAShareOfTheVolumeAndCostsBeyondWhatIsAllowed) {
  const PlanPoints points = points_of(4, 2);
  std::vector<float> dose(points.points.size(), 0);
  const std::vector<float> gland = {1.7f, 1.6f, 1.2f, 1.0f};  // half of the volume above 1.5
  std::ranges::copy(gland, dose.begin());
  EXPECT_NEAR(of({{"prostate", Side::kAbove, 1.45, 0.05, 1, 0, 0, 0}}, points, dose), 0.5, 1e-6);
  EXPECT_NEAR(of({{"prostate", Side::kAbove, 1.45, 0.05, 0, 10, 0.4, 0}}, points, dose), 10 * 0.1, 1e-5);
  EXPECT_EQ(of({{"prostate", Side::kAbove, 1.45, 0.05, 0, 10, 0.6, 0}}, points, dose), 0);
  // 2 cc of the 10 that the points stand for are allowed.
  EXPECT_NEAR(of({{"prostate", Side::kAbove, 1.45, 0.05, 0, 10, 0, 2}}, points, dose), 10 * 0.3, 1e-5);
}

TEST(PlanObjective, AGoalCostsNothingWhereItIsMetAndMoreTheFartherItIsMissed) {
  const PlanPoints points = points_of(100, 50);  // each part stands for 10 cc
  const auto cost = [&](const DoseGoal& goal, float gland, float urethra, int hot) {
    PlanObjective objective;
    objective.add_goals({goal});
    std::vector<float> dose(points.points.size());
    std::fill(dose.begin(), dose.begin() + 112, gland);
    std::fill(dose.begin() + 112, dose.end(), urethra);
    for (int i = 0; i < hot; ++i) dose[static_cast<std::size_t>(112 + i)] = 3;  // of the urethra's 50
    return PointObjective(objective, points).of(dose.data());
  };
  const DoseGoal cover{"prostate", "V100", "plan", "above", 95}, d90{"prostate", "D90", "plan", "above", 120};
  EXPECT_EQ(cost(cover, 1.1f, 0, 0), 0);
  EXPECT_GT(cost(cover, 0.99f, 0, 0), 1);
  EXPECT_GT(cost(d90, 1.1f, 0, 0), 1);
  EXPECT_EQ(cost(d90, 1.3f, 0, 0), 0);
  // D30 < 125 %: up to 30 % of the volume may have more.
  const DoseGoal d30{"urethra", "D30", "plan", "below", 125};
  EXPECT_EQ(cost(d30, 1, 1.1f, 13), 0);
  EXPECT_GT(cost(d30, 1, 1.1f, 16), 0);
  EXPECT_GT(cost(d30, 1, 1.3f, 16), cost(d30, 1, 1.1f, 16));
  // 2 cc of 10, and no more, may have more than the prescription.
  const DoseGoal d2cc{"urethra", "D2cc", "plan", "below", 100},
      v100cc{"urethra", "V100cc", "plan", "below", 2};
  for (const DoseGoal& goal : {d2cc, v100cc}) {
    EXPECT_EQ(cost(goal, 1, 0.5f, 8), 0) << goal.figure;
    EXPECT_GT(cost(goal, 1, 0.5f, 11), 0) << goal.figure;
  }
  EXPECT_EQ(cost({"bladder", "D2cc", "plan", "below", 10}, 1, 1, 50), 0);    // no such structure
  EXPECT_EQ(cost({"urethra", "D10", "implant", "below", 10}, 1, 1, 50), 0);  // not a plan's
}

TEST(PlanObjective, RowsAreAddedAndTakenAway) {
  const PlanPoints points = points_of(200, 20);
  const std::size_t count = points.points.size();
  std::vector<float> dose(count), row(count), sum(count), changed(count);
  for (std::size_t i = 0; i < count; ++i) {
    dose[i] = 0.005f * static_cast<float>(i);
    row[i] = 0.3f + 0.001f * static_cast<float>(i);
    sum[i] = dose[i] + row[i];
  }
  const PointObjective objective(PlanObjective::standard(), points);
  const RowChange add[] = {{row.data(), 1}};
  EXPECT_EQ(objective.with(dose.data(), add, changed.data()), objective.of(sum.data()));
  EXPECT_EQ(changed[150], sum[150]);
  const RowChange both[] = {{row.data(), 1}, {row.data(), -1}};
  EXPECT_NEAR(objective.with(dose.data(), both, nullptr), objective.of(dose.data()), 1e-5);
}

}  // namespace
}  // namespace brachy
