#include "core/brachytherapy/plan/template_grid.h"

#include <gtest/gtest.h>

#include <limits>

namespace brachy {
namespace {

TEST(TemplateGrid, NamesAndPlacesOfHolesAreInverse) {
  const TemplateGrid grid{26, 99, 2.5, {1, 2, 3}};
  for (int column = 0; column < grid.columns; ++column)
    for (int row = 0; row < grid.rows; ++row) {
      const auto p = grid.position(grid.name(column, row));
      ASSERT_TRUE(p) << grid.name(column, row);
      EXPECT_EQ(*p, Vec3(1 + 2.5 * column, 2 + 2.5 * row, 3));
      EXPECT_EQ(grid.nearest(*p, Vec3::UnitZ()), grid.name(column, row));
    }
}

TEST(TemplateGrid, ColumnsGoAlongXAndRowsAlongY) {
  const TemplateGrid grid;
  EXPECT_EQ(grid.position("A1"), Vec3(-30, -30, -60));
  EXPECT_EQ(grid.position("D4"), Vec3(-15, -15, -60));
  EXPECT_EQ(grid.position("d4"), grid.position("D4"));
  EXPECT_EQ(grid.position("M13"), Vec3(30, 30, -60));
  EXPECT_EQ(grid.extent(), "A1 … M13");
}

TEST(TemplateGrid, WhatIsNoHoleOfItIsNowhere) {
  const TemplateGrid grid;
  for (const char* hole : {"", "A", "4", "N1", "A14", "A0", "A-1", "A01", "A+1", "A1 ", " A1", "AA1", "A1.0",
                           "A99999999999", "1A",
                           "\xc3\x84"
                           "1"})
    EXPECT_FALSE(grid.position(hole)) << hole;
}

TEST(TemplateGrid, ANeedleBelongsToTheHoleThatItPassesWithinHalfASpacing) {
  const TemplateGrid grid;
  EXPECT_EQ(grid.nearest({2.4, -2.4, 20}, Vec3::UnitZ()), "G7");
  EXPECT_EQ(grid.nearest({2.6, -2.4, 20}, Vec3::UnitZ()), "H7");
  // Oblique, and pointing out: where the line meets the template counts.
  EXPECT_EQ(grid.nearest({0, 0, -10}, Vec3(0.2, 0, 1)), "E7");
  EXPECT_EQ(grid.nearest({0, 0, -10}, Vec3(-0.2, 0, -1)), "E7");
}

TEST(TemplateGrid, BesideTheGridThereIsNoHole) {
  const TemplateGrid grid;
  EXPECT_EQ(grid.nearest({32.4, 0, 0}, Vec3::UnitZ()), "M7");
  EXPECT_FALSE(grid.nearest({32.6, 0, 0}, Vec3::UnitZ()));
  EXPECT_FALSE(grid.nearest({0, -32.6, 0}, Vec3::UnitZ()));
  EXPECT_FALSE(grid.nearest({0, 0, 0}, Vec3::UnitX()));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(grid.nearest({nan, 0, 0}, Vec3::UnitZ()));
}

}  // namespace
}  // namespace brachy
