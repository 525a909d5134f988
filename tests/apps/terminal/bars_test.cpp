#include "apps/terminal/bars.h"

#include <gtest/gtest.h>

#include <cmath>

#include "apps/terminal/terminal.h"

namespace brachy {
namespace {

TEST(Bar, FillsInEighthsOfAColumn) {
  EXPECT_EQ(bar(0, 4), "    ");
  EXPECT_EQ(bar(0.5, 4), "██  ");
  EXPECT_EQ(bar(1.0 / 32, 4), "▏   ");
  EXPECT_EQ(bar(0.9, 4), "███▋");
  EXPECT_EQ(bar(7, 4), "████");
  EXPECT_EQ(bar(-1, 4), "    ");
  EXPECT_EQ(bar(std::nan(""), 4), "    ");
  EXPECT_EQ(bar(0.5, 0), "");
}

TEST(Bar, GoesFromTheMiddleByItsSign) {
  EXPECT_EQ(centred_bar(0, 7), "   │   ");
  EXPECT_EQ(centred_bar(1, 7), "   │███");
  EXPECT_EQ(centred_bar(-1, 7), "███│   ");
  EXPECT_EQ(centred_bar(-0.5, 7), " ▐█│   ");
  for (double share = -1.2; share <= 1.2; share += 0.01)
    EXPECT_EQ(columns_of(centred_bar(share, 21)), 21u) << share;
}

TEST(ValueHistory, ShowsTheFarthestFromZeroOfEachQuarterSecond) {
  ValueHistory history;
  history.add(1, 0.1);
  history.add(1.1, 4);
  history.add(1.2, -1);
  history.add(1.3, 2);
  EXPECT_EQ(history.sparkline(4, 0, 4), "  █▅");
  EXPECT_EQ(history.largest(), 4);
  EXPECT_EQ(history.smallest(), 2);
  EXPECT_EQ(history.sparkline(1, 0, 4), "▅");
}

TEST(ValueHistory, MarksWhatHappenedAndLeavesGaps) {
  ValueHistory history;
  history.add(0, 1, true);
  history.add(1, 1);  // after three quarters of a second of which nothing is known
  history.add(1.3, std::nan(""));
  EXPECT_EQ(history.sparkline(6, 0, 1), "▼   █ ");
  history.add(0.5, 1);  // starts over
  EXPECT_EQ(history.sparkline(6, 0, 1), "     █");
  EXPECT_TRUE(std::isnan(ValueHistory().largest()));
}

TEST(ValueHistory, KeepsALimitedPast) {
  ValueHistory history;
  for (int i = 0; i < 10'000; ++i) history.add(i, 1);
  EXPECT_EQ(columns_of(history.sparkline(1000, 0, 1)), 1000u);
  history.add(1e9, 1);
  EXPECT_EQ(history.sparkline(3, 0, 1), "  █");
}

TEST(TerminalText, CountsAndCutsColumnsNotBytes) {
  const std::string text = "\x1b[31mψ3,1\x1b[0m …";
  EXPECT_EQ(columns_of(text), 6u);
  EXPECT_EQ(cut_to(text, 2), "\x1b[31mψ3\x1b[0m");
  EXPECT_EQ(padded_to("ψ", 3), "ψ  ");
  EXPECT_EQ(cut_to("\x1b[31", 3), "\x1b[31");  // no end
}

}  // namespace
}  // namespace brachy
