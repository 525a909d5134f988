#include "apps/score/seed_assignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace brachy {
namespace {

using Costs = std::vector<std::vector<double>>;

double total_of(const Costs& costs, const std::vector<std::optional<std::size_t>>& columns,
                double unassigned) {
  double total = 0;
  for (std::size_t row = 0; row < columns.size(); ++row)
    total += columns[row] ? costs[row][*columns[row]] : unassigned;
  return total;
}

/// Tries every assignment of the rows from `row` on.
double cheapest_by_trial(const Costs& costs, std::vector<bool>& is_taken, std::size_t row,
                         double unassigned) {
  if (row == costs.size()) return 0;
  double best = unassigned + cheapest_by_trial(costs, is_taken, row + 1, unassigned);
  for (std::size_t column = 0; column < is_taken.size(); ++column) {
    if (is_taken[column]) continue;
    is_taken[column] = true;
    best = std::min(best, costs[row][column] + cheapest_by_trial(costs, is_taken, row + 1, unassigned));
    is_taken[column] = false;
  }
  return best;
}

std::vector<std::optional<std::size_t>> assigned(const Costs& costs, std::size_t columns, double unassigned) {
  return cheapest_assignment(costs.size(), columns, unassigned,
                             [&](std::size_t row, std::size_t column) { return costs[row][column]; });
}

TEST(SeedAssignment, IsAsCheapAsTheBestOfAllAssignments) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 400; ++trial) {
    const std::size_t rows = random() % 7, columns = random() % 6;
    const double unassigned = 1 + random() % 12;
    Costs costs(rows, std::vector<double>(columns));
    for (auto& row : costs)
      for (double& cost : row) cost = random() % 16;  // whole numbers: ties are frequent, sums exact
    const auto columns_of = assigned(costs, columns, unassigned);
    ASSERT_EQ(columns_of.size(), rows);
    std::vector<bool> is_taken(columns, false);
    for (std::size_t row = 0; row < rows; ++row) {
      if (!columns_of[row]) continue;
      EXPECT_FALSE(is_taken[*columns_of[row]]) << trial;
      is_taken[*columns_of[row]] = true;
      EXPECT_LE(costs[row][*columns_of[row]], unassigned) << trial;
    }
    std::vector<bool> none(columns, false);
    EXPECT_EQ(total_of(costs, columns_of, unassigned), cheapest_by_trial(costs, none, 0, unassigned))
        << trial;
  }
}

TEST(SeedAssignment, ANearPairGivesWayWhereTheSumIsLess) {
  // Nearest first would take 1 and then 9; the sum of 4 and 3 is less.
  const auto columns_of = assigned({{1, 4}, {3, 9}}, 2, 20);
  EXPECT_EQ(columns_of[0], std::optional<std::size_t>(1));
  EXPECT_EQ(columns_of[1], std::optional<std::size_t>(0));
}

TEST(SeedAssignment, OfMoreRowsThanColumnsTheDearestStaysWithout) {
  const auto columns_of = assigned({{5}, {2}, {3}}, 1, 10);
  EXPECT_FALSE(columns_of[0]);
  EXPECT_EQ(columns_of[1], std::optional<std::size_t>(0));
  EXPECT_FALSE(columns_of[2]);
}

}  // namespace
}  // namespace brachy
