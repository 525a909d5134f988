#include "core/brachytherapy/plan/template_grid.h"

#include <gtest/gtest.h>

#include <limits>

namespace brachy {
namespace {

TEST(TemplateGrid, NamesAndPlacesOfHolesAreInverse) {
  for (const TemplateGrid& grid :
       {TemplateGrid{26, 99, 2.5, {1, 2, 3}}, TemplateGrid{26, 99, 2.5, {1, 2, 3}, "right"},
        TemplateGrid{26, 99, 2.5, {1, 2, 3}, "left", true},
        TemplateGrid{25, 98, 2.5, {1, 2, 3}, "right", true}})
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
  EXPECT_EQ(grid.position("M13"), Vec3(30, 30, -60));
  EXPECT_EQ(grid.lacks("N1"), "the template has A1 … M13");
}

// As clinical sheets have them: A is at the patient's right, which is +x.
TEST(TemplateGrid, LettersMayBeginAtThePatientsRight) {
  const TemplateGrid grid = TemplateGrid().named("right", false);
  EXPECT_EQ(grid.position("A1"), Vec3(30, -30, -60));
  EXPECT_EQ(grid.position("D4"), Vec3(15, -15, -60));
  EXPECT_EQ(grid.position("M13"), Vec3(-30, 30, -60));
  EXPECT_EQ(grid.nearest({16, -14, 20}, Vec3::UnitZ()), "D4");
  EXPECT_EQ(grid.lacks("N1"), "the template has A1 … M13");
}

TEST(TemplateGrid, HalfStepsLieBetweenLettersAndNumbers) {
  const TemplateGrid grid = TemplateGrid().named("right", true);
  EXPECT_EQ(grid.position("A1"), Vec3(30, -30, -60));
  EXPECT_EQ(grid.position("a1"), Vec3(25, -30, -60));
  EXPECT_EQ(grid.position("A1.5"), Vec3(30, -25, -60));
  EXPECT_EQ(grid.position("d4.5"), Vec3(-5, 5, -60));
  EXPECT_EQ(grid.position("G7"), Vec3(-30, 30, -60));
  EXPECT_EQ(grid.lacks("N1"), "the template has A1 … G7");
  for (const char* hole :
       {"G7.5", "g7", "H1", "A8", "A1.0", "A1.25", "A.5", "A0.5", "A01.5", "A1.5.5", "A1,5"})
    EXPECT_FALSE(grid.position(hole)) << hole;
}

TEST(TemplateGrid, AHalfStepIsNotReadAsAWholeOne) {
  const TemplateGrid grid;
  EXPECT_FALSE(grid.position("d4"));
  EXPECT_FALSE(grid.position("D4.5"));
  EXPECT_NE(grid.lacks("d4").find("half_steps"), std::string::npos);
}

TEST(TemplateGrid, AHoleIsRenamedFromOneSetOfNamesToAnother) {
  const TemplateGrid wire, clinic = wire.named("right", true);
  EXPECT_EQ(clinic.renamed("A1", wire), "G1");
  EXPECT_EQ(wire.renamed("A1", clinic), "M1");
  EXPECT_EQ(wire.renamed("d4.5", clinic), "F8");
  EXPECT_EQ(wire.renamed("no hole", clinic), "no hole");
  EXPECT_EQ(clinic.named_as_on_wire(), wire);
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
