#include "core/brachytherapy/plan/optimiser/needle_load.h"

#include <gtest/gtest.h>

namespace brachy {
namespace {

TEST(NeedleLoad, SeedsLieWhereThePlanPutsThem) {
  for (const char* train : {"s", "ss", "s-s--s", "-s-ss", "--s"}) {
    const NeedleLoad load = NeedleLoad::from(80, train);
    EXPECT_EQ(load.train(), train);
    const PlanNeedle needle{"A1", 0, train};
    EXPECT_EQ(load.length_mm(), needle.train_length_mm());
    std::array<int, NeedleLoad::kMostElements> rows;
    const auto offsets = needle.seed_offsets_mm();
    ASSERT_EQ(static_cast<std::size_t>(load.seed_rows(rows)), offsets.size());
    for (std::size_t s = 0; s < offsets.size(); ++s)
      EXPECT_EQ(row_depth_mm(rows[s]), 80 - offsets[s]) << train;
  }
}

TEST(NeedleLoad, TrimmingLeavesTheSeedsWhereTheyAre) {
  NeedleLoad load = NeedleLoad::from(80, "---s-s--");
  std::array<int, NeedleLoad::kMostElements> before, after;
  const int count = load.seed_rows(before);
  load.trim();
  EXPECT_EQ(load.train(), "-s-s");  // two spacers are 11 mm of depth
  EXPECT_EQ(load.tip_mm, 69);
  ASSERT_EQ(load.seed_rows(after), count);
  for (int s = 0; s < count; ++s)
    EXPECT_EQ(after[static_cast<std::size_t>(s)], before[static_cast<std::size_t>(s)]);
}

}  // namespace
}  // namespace brachy
