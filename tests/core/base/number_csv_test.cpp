#include "core/base/number_csv.h"

#include <gtest/gtest.h>

#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

std::vector<double> values_of(const std::string& text) {
  return parse_number_csv(text, "p.csv", "x,y,z").values;
}

TEST(NumberCsv, IsReadAsSpreadsheetsAndTrackersWriteIt) {
  const std::vector<double> all = {1, -2.5, 3000, 4, 5, 6};
  for (const char* text :
       {"x,y,z\n1,-2.5,3e3\n4,5,6\n", "\xEF\xBB\xBFx,y,z\r\n1,-2.5,3e3\r\n4,5,6\r\n",
        "x, y, z\n1, -2.5, 3e3\n 4 ,5 , 6 \n", "X,Y,Z\n1,-2.5,3e3\n4,5,+6\n",
        "\"x\",\"y\",\"z\"\n\"1\",\"-2.5\",\"3e3\"\n4,\"5\",6\n", "x\ty\tz\n1\t-2.5\t3e3\n4\t5\t6\n",
        "# made by\n\nx\t y\t\"z\"\n1 \t-2.5\t \"3e3\"\n\n4\t5\t6"})
    EXPECT_EQ(values_of(text), all) << text;
}

TEST(NumberCsv, WhatMayBeReadInTwoWaysIsRefusedWithItsLine) {
  const auto refused = [](const char* text) { return test::user_error([&] { values_of(text); }); };
  EXPECT_EQ(refused("x;y;z\n1;2;3\n").find("p.csv:1: semicolons separate the columns"), 0u);
  EXPECT_EQ(refused("x\ty\tz\n1,5\t2\t3\n").find("p.csv:2: "), 0u);
  EXPECT_EQ(refused("x,y,z\n1,2\n").find("p.csv:2: found 2 columns, expected 3"), 0u);
  EXPECT_EQ(refused("y,x,z\n1,2,3\n").find("p.csv:1: expected the header x,y,z"), 0u);
  EXPECT_EQ(refused("x,y,z\n\"1,2,3\n").find("p.csv:2: column 1 is not a number"), 0u);
}

TEST(NumberCsv, TheHeaderIsReadInOneForm) {
  EXPECT_EQ(csv_header("# a\n\xEF\n"), "\xEF");
  EXPECT_EQ(csv_header("\xEF\xBB\xBF\n T_s\tQW \n1\t2\n"), "t_s,qw");
  EXPECT_EQ(csv_header(""), "");
}

}  // namespace
}  // namespace brachy
