#include "apps/terminal/set_up_progress.h"

#include <gtest/gtest.h>

namespace brachy {
namespace {

TEST(SetUpText, SaysNothingInTheFirstSecondAndThenALineASecond) {
  SetUpText text;
  EXPECT_EQ(text.at(0, 0), std::nullopt);
  EXPECT_EQ(text.at(0.9, 0.3), std::nullopt);
  EXPECT_EQ(text.at(1.1, 0.407), "set-up: boundary and regions, 40 %");
  EXPECT_EQ(text.at(2.0, 0.6), std::nullopt);
  EXPECT_EQ(text.at(2.2, 0.7), "set-up: boundary and regions, 70 %");
  EXPECT_EQ(text.at(9, 1), "set-up: boundary and regions, 100 %");
}

TEST(SetUpText, AQuickSetUpPrintsNothing) {
  int lines = 0;
  const auto set_up = announced_set_up([&](const std::string&) { ++lines; });
  set_up.progress(0.5);
  set_up.progress(1);
  EXPECT_EQ(lines, 0);
}

}  // namespace
}  // namespace brachy
