#include "core/brachytherapy/dose/dose_goal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "test_paths.h"

namespace brachy {
namespace {

std::string row_of(const DoseGoal& goal) {
  std::ostringstream row;
  row << "| " << goal.structure << " | " << goal.figure << " | " << goal.stage << " | " << goal.side << " "
      << goal.limit << " | " << goal.source << " | ";
  return row.str();
}

TEST(DoseGoals, AreThoseOfTheTable) {
  std::ifstream page(BRACHY_SOURCE_DIR "/core/brachytherapy/dose/README.md");
  std::vector<std::string> rows;
  for (std::string line; std::getline(page, line);)
    if (line.starts_with("| ") &&
        (line.find(" | plan | ") != line.npos || line.find(" | implant | ") != line.npos))
      rows.push_back(line);
  const std::vector<DoseGoal> goals = default_dose_goals();
  ASSERT_EQ(rows.size(), goals.size());
  for (std::size_t i = 0; i < goals.size(); ++i) {
    EXPECT_TRUE(rows[i].starts_with(row_of(goals[i]))) << rows[i] << "\nis not\n" << row_of(goals[i]);
    EXPECT_FALSE(goals[i].source.empty());
    EXPECT_TRUE(find_dose_index(goals[i].figure)) << goals[i].figure;
  }
}

TEST(DoseGoals, AreMetAtTheirLimitFromAboveAndBelowItFromBelow) {
  const DoseGoal v100{"prostate", "V100", "plan", "above", 95}, v150{"prostate", "V150", "plan", "below", 60};
  EXPECT_TRUE(v100.is_met_by(95, 145));
  EXPECT_FALSE(v100.is_met_by(94.9, 145));
  EXPECT_FALSE(v100.is_met_by(std::nan(""), 145));
  EXPECT_TRUE(v150.is_met_by(59.9, 145));
  EXPECT_FALSE(v150.is_met_by(60, 145));
}

TEST(DoseGoals, OfADoseAreInProportionToThePrescription) {
  const DoseGoal d30{"urethra", "D30", "plan", "below", 125}, cc{"rectum", "V100cc", "plan", "below", 1};
  EXPECT_NEAR(d30.limit_for(145), 181.25, 1e-12);
  EXPECT_NEAR(d30.limit_for(125), 156.25, 1e-12);
  EXPECT_EQ(cc.limit_for(125), 1);
}

}  // namespace
}  // namespace brachy
