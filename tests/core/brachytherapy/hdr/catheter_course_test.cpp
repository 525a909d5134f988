#include "core/brachytherapy/hdr/catheter_course.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

#include "core/base/error.h"

namespace brachy {
namespace {

// Points every 2.5 mm on an arc of 100 mm radius in the plane y = 1, the tip first, its direction +z.
std::vector<Vec3> arc() {
  std::vector<Vec3> points;
  for (int i = 0; i < 20; ++i) {
    const double angle = 2.5 * i / 100;
    points.emplace_back(100 * (1 - std::cos(angle)), 1, -100 * std::sin(angle));
  }
  return points;
}

std::string file_of(const std::string& rows) {
  std::ostringstream file;
  file << kCatheterHeader << "\n" << rows;
  return file.str();
}

TEST(CatheterCourse, ADwellLiesOnTheBentCatheterAndPointsToItsTip) {
  const std::vector<Vec3> course = arc();
  for (const double offset : {0.0, 5.0, 6.3, 22.5, 40.0}) {
    const Dwell dwell = dwell_at(course, offset);
    const double angle = offset / 100;
    EXPECT_LT((dwell.position - Vec3(100 * (1 - std::cos(angle)), 1, -100 * std::sin(angle))).norm(), 0.01)
        << offset;
    EXPECT_NEAR(dwell.axis.norm(), 1, 1e-12);
    // Within the arc between two points.
    EXPECT_GT(dwell.axis.dot(Vec3(-std::sin(angle), 0, std::cos(angle))), std::cos(2.6 / 100)) << offset;
  }
}

TEST(CatheterCourse, FilesReadBackBitForBit) {
  const std::vector<CatheterCourse> all = {{3, arc(), arc()}, {0, {Vec3(1, 2, 3), Vec3(1, 2, 0.5)}, arc()}};
  std::vector<CatheterCourse> some = all;
  some[1].rest.resize(2);
  EXPECT_EQ(parse_catheters(to_csv(some), "c.csv"), some);
  EXPECT_TRUE(parse_catheters(file_of(""), "c.csv").empty());
}

TEST(CatheterCourse, ATornFileIsRefusedWithItsLine) {
  const auto refusal = [](const std::string& rows) -> std::string {
    try {
      parse_catheters(file_of(rows), "c.csv");
    } catch (const UserError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal("0,0,1,2,3,1,2,3\n"), "c.csv:2: the last catheter has only a tip; is the file whole?");
  EXPECT_EQ(refusal("0,0,1,2,3,1,2,3\n0,5,1,2,3,1,2,3\n"),
            "c.csv:3: offset_mm does not go 0, 2.5, 5, … along one needle; was the file edited?");
}

}  // namespace
}  // namespace brachy
