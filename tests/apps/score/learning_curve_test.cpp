#include "apps/score/learning_curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace brachy {
namespace {

TEST(LearningCurve, AnExponentialIsFoundAgain) {
  std::vector<double> values;
  for (int n = 0; n < 12; ++n) values.push_back(1.5 + 4 * std::exp(-n / 2.5));
  values[5] = std::nan("");
  const auto curve = learning_curve(values);
  ASSERT_TRUE(curve);
  EXPECT_NEAR(curve->plateau, 1.5, 0.02);
  EXPECT_NEAR(curve->gain, 4, 0.03);
  EXPECT_NEAR(curve->sessions, 2.5, 0.05);
  EXPECT_GT(curve->r_squared, 0.999);
  EXPECT_NEAR(curve->at(3), 1.5 + 4 * std::exp(-3 / 2.5), 0.02);
}

TEST(LearningCurve, ALineAConstantAndFewSessionsHaveNone) {
  EXPECT_FALSE(learning_curve(std::vector<double>{8, 7, 6, 5, 4, 3, 2, 1}));
  EXPECT_FALSE(learning_curve(std::vector<double>(9, 3.0)));
  EXPECT_FALSE(learning_curve(std::vector<double>{2, 3, 2, 3.5, 2.5, 3, 2, 3}));  // scatter alone
  EXPECT_FALSE(learning_curve(std::vector<double>{8, 4, 2, 1, 0.5}));
  EXPECT_FALSE(learning_curve({}));
}

TEST(LearningCurve, TheSlopeOfALineLeavesTheUnknownOut) {
  EXPECT_NEAR(slope_per_session(std::vector<double>{1, std::nan(""), 5, 7}), 2, 1e-12);
  EXPECT_TRUE(std::isnan(slope_per_session(std::vector<double>{1})));
}

}  // namespace
}  // namespace brachy
