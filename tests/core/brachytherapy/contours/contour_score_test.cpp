// Outlines of a volume study against glands whose cross-sections are known exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/brachytherapy/contours/contour_score.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

// A CSV of outlines.
struct Drawing {
  std::string text = "slice,x_mm,y_mm,z_mm\n";
  int slices = 0;

  void add(const std::vector<Vec3>& corners) {
    ++slices;
    for (const Vec3& p : corners)
      text += std::to_string(slices) + "," + std::to_string(p.x()) + "," + std::to_string(p.y()) + "," +
              std::to_string(p.z()) + "\n";
  }
  void add_box(double x0, double x1, double y0, double y1, double z) {
    add({{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}});
  }
  ContourSet read() const { return parse_contours(text, "c.csv"); }
};

std::string contour_refusal(const std::string& text) {
  try {
    parse_contours(text, "c.csv");
  } catch (const UserError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(ContourScore, IsPerfectForTheGlandsOwnSections) {
  // z = −10 … 10 is cut in the planes −9, −6, … 9: seven, of 3 mm each, 21 mm for 20.
  const SurfaceMesh box = test::make_box({-10, -8, -10}, {10, 8, 10});
  Drawing drawing;
  for (double z = -9; z <= 9; z += 3) drawing.add_box(-10, 10, -8, 8, z);
  const ContourScore score = score_contours(drawing.read(), box);
  EXPECT_EQ(score.slices.size(), 7u);
  EXPECT_EQ(score.missed + score.beyond, 0u);
  EXPECT_NEAR(score.dice, 1, 1e-12);
  EXPECT_NEAR(score.hausdorff_mm, 0, 1e-12);
  EXPECT_NEAR(score.gland_cm3, 6.4, 1e-12);
  EXPECT_NEAR(score.outlined_cm3, 6.72, 1e-12);
  EXPECT_NEAR(score.volume_error_percent(), 5, 1e-9);
}

TEST(ContourScore, HasTheDiceAndDistancesOfAShiftedBox) {
  const SurfaceMesh box = test::make_box({0, 0, -10}, {20, 10, 10});
  Drawing drawing;
  for (const double z : {-7.5, -2.5, 2.5, 7.5}) drawing.add_box(3, 23, 0, 10, z);
  const ContourScore score = score_contours(drawing.read(), box);
  EXPECT_NEAR(score.dice, 17.0 / 20, 1e-12);
  EXPECT_NEAR(score.volume_error_percent(), 0, 1e-9);
  // Of the drawn outline's points on its far side, and the gland's on the other.
  EXPECT_NEAR(score.hausdorff_mm, 3, 1e-9);
  EXPECT_NEAR(score.hausdorff_95_mm, 3, 1e-9);  // a side of 10 in 60 mm
  // A side of 10 lies 3 mm outside; on the sides of 20 the last 3 mm rise from 0 to 3; the other side of 10 lies
  // inside, 3 mm from one, less at its ends.
  const double mean = (10 * 3 + 2 * 3 * 1.5 + (4 * 3 + 2 * 3 * 1.5)) / 60;
  EXPECT_NEAR(score.mean_mm, mean, 0.01);
}

TEST(ContourScore, MeetsTheExactAreasOfCircles) {
  // Two regular polygons about circles of 15 mm, 9 mm apart: the lens of two circles.
  constexpr double kRadius = 15, kApart = 9;
  constexpr int kCorners = 720;
  const auto circle = [&](double x) {
    std::vector<PlaneEdge> edges;
    const auto at = [&](int k) {
      const double angle = 2 * std::numbers::pi * k / kCorners;
      return Vec2(x + kRadius * std::cos(angle), kRadius * std::sin(angle));
    };
    for (int k = 0; k < kCorners; ++k) edges.push_back({at(k), at(k + 1)});
    return edges;
  };
  const RegionAreas areas = region_areas(circle(0), circle(kApart));
  const double lens = 2 * kRadius * kRadius * std::acos(kApart / (2 * kRadius)) -
                      0.5 * kApart * std::sqrt(4 * kRadius * kRadius - kApart * kApart);
  EXPECT_NEAR(areas.first, std::numbers::pi * kRadius * kRadius, 0.02);
  EXPECT_NEAR(areas.second, areas.first, 1e-9);
  EXPECT_NEAR(areas.both, lens, 0.02);
}

TEST(ContourScore, TakesOutlinesThatCrossThemselvesByTheEvenOddRule) {
  const std::vector<PlaneEdge> bow = {{Vec2(0, 0), Vec2(10, 10)},
                                      {Vec2(10, 10), Vec2(10, 0)},
                                      {Vec2(10, 0), Vec2(0, 10)},
                                      {Vec2(0, 10), Vec2(0, 0)}};
  const std::vector<PlaneEdge> left = {{Vec2(0, 0), Vec2(5, 0)},
                                       {Vec2(5, 0), Vec2(5, 10)},
                                       {Vec2(5, 10), Vec2(0, 10)},
                                       {Vec2(0, 10), Vec2(0, 0)}};
  const RegionAreas areas = region_areas(bow, left);
  EXPECT_NEAR(areas.first, 50, 1e-9);
  EXPECT_NEAR(areas.both, 25, 1e-9);
}

TEST(ContourScore, CountsPlanesThatWereMissedAndPlanesBeyondTheGland) {
  const SurfaceMesh box = test::make_box({0, 0, -12}, {10, 10, 12});
  Drawing drawing;  // in steps of 5: −10 … 10 has the gland; 0 is skipped, and 15 is beyond
  for (const double z : {-10.0, -5.0, 5.0, 10.0, 15.0}) drawing.add_box(0, 10, 0, 10, z);
  const ContourScore score = score_contours(drawing.read(), box);
  EXPECT_EQ(score.slices.size(), 6u);
  EXPECT_EQ(score.missed, 1u);
  EXPECT_EQ(score.beyond, 1u);
  EXPECT_NEAR(score.dice, 2 * 4.0 / (5 + 5), 1e-12);
  EXPECT_NEAR(score.hausdorff_mm, 0, 1e-12);
}

TEST(ContourScore, IsTheSameInTurnedPlanes) {
  const SurfaceMesh box = test::make_box({-10, -8, -10}, {10, 8, 10});
  RigidTransform X;
  X.R = Eigen::AngleAxisd(0.3, Vec3(1, 2, 0.5).normalized()).toRotationMatrix();
  X.p = Vec3(5, -60, 30);
  SurfaceMesh turned = box;
  for (Vec3& v : turned.vertices) v = X * v;
  Drawing drawing;
  for (const double z : {-8.0, -3.0, 2.0, 7.0})
    drawing.add({X * Vec3(-9, -8, z), X * Vec3(10, -8, z), X * Vec3(10, 8, z), X * Vec3(-9, 8, z)});
  const ContourScore score = score_contours(drawing.read(), turned);
  EXPECT_EQ(score.slices.size(), 4u);
  EXPECT_NEAR(score.dice, 2 * 19.0 / (19 + 20), 1e-5);
  EXPECT_NEAR(score.hausdorff_mm, 1, 1e-4);
}

TEST(ContourScore, OfOneSliceHasNoVolume) {
  Drawing drawing;
  drawing.add_box(0, 10, 0, 10, 0);
  const ContourScore score = score_contours(drawing.read(), test::make_box({0, 0, -12}, {10, 10, 12}));
  EXPECT_EQ(score.slices.size(), 1u);
  EXPECT_NEAR(score.dice, 1, 1e-12);
  EXPECT_EQ(score.outlined_cm3, 0);
}

TEST(ContourFile, RefusesWithTheLineAndTheFix) {
  const std::string header = "slice,x_mm,y_mm,z_mm\n", square = "1,0,0,0\n1,9,0,0\n1,9,9,0\n1,0,9,0\n";
  const auto has = [](const std::string& text, std::initializer_list<const char*> parts) {
    const std::string message = contour_refusal(text);
    EXPECT_EQ(message.find('\n'), std::string::npos);
    for (const char* part : parts)
      EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
  };
  has("", {"c.csv"});
  has("x,y\n1,2\n", {"c.csv:1", "slice,x_mm"});
  has(header, {"c.csv"});
  has(header + "1,0,0\n", {"c.csv:2"});
  has(header + "1.5,0,0,0\n", {"c.csv:2", "whole number"});
  has(header + "1,0,0,0\n1,9,0,0\n", {"c.csv:2", "slice 1", "three corners"});
  has(header + "1,0,0,0\n1,9,0,0\n1,18,0,0\n", {"slice 1", "no area"});
  has(header + "1,0,0,0\n1,nan,0,0\n1,18,0,0\n", {"c.csv:3"});
  has(header + "1,0,0,0\n1,99999,0,0\n1,18,0,0\n", {"c.csv:3", "mm"});
  has(header + square + "2,0,0,5\n2,9,0,5\n2,9,9,5\n1,0,0,0\n", {"c.csv:9", "begins again"});
  has(header + square + "2,0,0,0\n2,9,0,0\n2,9,9,0\n", {"c.csv:6", "in the plane of slice"});
  has(header + square + "2,0,0,5\n2,9,0,9\n2,9,9,5\n", {"c.csv:6", "off its plane"});
  has(header + square + "2,0,0,5\n2,9,0,5\n2,9,9,5\n3,0,0,12\n3,9,0,12\n3,9,9,12\n",
      {"c.csv:9", "even steps"});
  std::string many = header;
  for (std::size_t k = 0; k <= kMaxCorners; ++k) many += "1," + std::to_string(k) + ",0,0\n";
  has(many, {"more than 2000 corners"});
}

TEST(ContourFile, ClosesOutlinesWhetherDrawnClosedOrNot) {
  const std::string open = "slice,x_mm,y_mm,z_mm\n7,0,0,0\n7,9,0,0\n7,9,9,0\n";
  for (const std::string& text : {open, open + "7,0,0,0\n"}) {
    const ContourSet set = parse_contours(text, "c.csv");
    ASSERT_EQ(set.contours.size(), 1u);
    EXPECT_EQ(set.contours[0].slice, 7);
    EXPECT_EQ(set.contours[0].corners.size(), 3u);
    EXPECT_NEAR(region_areas(set.contours[0].edges(), {}).first, 40.5, 1e-9);
  }
}

TEST(ContourScore, MeasuresEachSliceAgainstTheGlandAsItWasThen) {
  // The gland goes 4 mm to the side between the first slice and the second; so does what is drawn.
  const SurfaceMesh before = test::make_box({0, 0, 0}, {20, 10, 15}),
                    after = test::make_box({4, 0, 0}, {24, 10, 15});
  Drawing drawing;
  drawing.add_box(0, 20, 0, 10, 2);
  drawing.add_box(4, 24, 0, 10, 7);
  const ContourSet set = drawing.read();
  const std::array<const SurfaceMesh*, 2> both = {&before, &after};
  const ContourStudy study = make_study(set, both);
  const ContourScore score = score_study(study);
  ASSERT_EQ(score.slices.size(), 3u);
  EXPECT_EQ(score.slices[0].dice(), 1);
  EXPECT_EQ(score.slices[1].dice(), 1);
  EXPECT_TRUE(score.slices[2].is_missed());
  EXPECT_EQ(study.planes[2].shape, 1u) << "of the nearest outlined plane";
  EXPECT_NEAR(score.dice, 0.8, 1e-12);
  EXPECT_NEAR(score.gland_cm3, 3, 1e-12);
  EXPECT_LT(score_contours(set, before).dice, 0.8);
}

TEST(ContourSet, OfNoFileIsCheckedAlike) {
  const std::vector<Vec3> square = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}};
  const auto at = [&](double z, double tilt) {
    std::vector<Vec3> corners = square;
    for (Vec3& corner : corners) corner.z() = z + tilt * corner.x();
    return corners;
  };
  const ContourSet set = make_contours({{4, at(5, 0)}, {2, at(0, 0)}, {9, at(15, 0)}});
  ASSERT_EQ(set.contours.size(), 3u);
  EXPECT_EQ(set.contours[0].slice, 2);
  EXPECT_EQ(set.step_mm, 5);
  const auto refused = [](const std::vector<OutlinedSlice>& slices) -> std::string {
    try {
      make_contours(slices);
    } catch (const UserError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refused({}), "there is no outline; outline a slice");
  EXPECT_TRUE(refused({{1, {square[0], square[1]}}}).starts_with("slice 1 encloses no area"));
  EXPECT_NE(refused({{1, at(0, 0)}, {2, at(5, 0.2)}}).find("not parallel"), std::string::npos);
  EXPECT_NE(refused({{1, at(0, 0)}, {2, at(5, 0)}, {3, at(12, 0)}}).find("even steps"), std::string::npos);
}

TEST(PlaneSection, IsJoinedToAnOutlineForEachPiece) {
  SurfaceMesh two = test::make_box({0, 0, 0}, {10, 10, 10});
  const SurfaceMesh other = test::make_box({20, 0, 0}, {24, 5, 10});
  const auto first = static_cast<std::uint32_t>(two.vertices.size());
  two.vertices.insert(two.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const Triangle& t : other.triangles)
    two.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  RigidTransform X_WS;
  X_WS.p = {0, 0, 5};
  const std::vector<PlaneEdge> section = plane_section(two, X_WS);
  const auto outlines = outlines_of(section);
  ASSERT_EQ(outlines.size(), 2u);
  EXPECT_EQ(outlines[0].size() + outlines[1].size(), section.size());
  std::vector<double> areas;
  for (const auto& outline : outlines) {
    double twice = 0;
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const Vec2 &a = outline[k], &b = outline[(k + 1) % outline.size()];
      twice += a.x() * b.y() - a.y() * b.x();
    }
    areas.push_back(std::abs(twice) / 2);
  }
  std::ranges::sort(areas);
  EXPECT_NEAR(areas[0], 20, 1e-9);
  EXPECT_NEAR(areas[1], 100, 1e-9);
}

}  // namespace
}  // namespace brachy
