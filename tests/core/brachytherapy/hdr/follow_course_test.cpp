// Catheters that follow their courses.
#include <gtest/gtest.h>

#include "core/brachytherapy/hdr/catheter_course.h"

namespace brachy {
namespace {

/// A quarter of a circle of 60 mm about the y axis, from the tip backwards, in chords of 3°.
std::vector<Vec3> quarter_circle() {
  std::vector<Vec3> course;
  for (int k = 0; k <= 30; ++k) {
    const double t = k * 3 * M_PI / 180;
    course.emplace_back(60 * (1 - std::cos(t)), 4, -60 * std::sin(t));
  }
  return course;
}

RigidTransform at_place(const std::vector<Vec3>& course, double offset) {
  return {
      Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), course_direction(course, offset)).toRotationMatrix(),
      point_along(course, offset).position};
}

TEST(FollowCourse, ATipOnTheCourseHasTheCourseBehindIt) {
  const std::vector<Vec3> course = quarter_circle();
  for (const double offset : {0.0, 1.3, 3.14, 20.0, 77.7}) {
    const std::vector<Vec3> points = follow_course(course, at_place(course, offset));
    ASSERT_GT(points.size(), 4u) << offset;
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_LT(nearest_place(course, points[i]).distance_mm, 1e-9) << offset << ": " << i;
    for (std::size_t i = 1; i < points.size(); ++i)
      EXPECT_NEAR((points[i] - points[i - 1]).norm(), CatheterCourse::kStepMm, 0.01);
  }
}

TEST(FollowCourse, ATipBesideItTakesItAlong) {
  const std::vector<Vec3> course = quarter_circle();
  RigidTransform X_WN = at_place(course, 0);
  const std::vector<Vec3> on = follow_course(course, X_WN);
  X_WN.p += Vec3(0, 2, 0);
  const std::vector<Vec3> beside = follow_course(course, X_WN);
  ASSERT_EQ(on.size(), beside.size());
  for (std::size_t i = 0; i < on.size(); ++i) EXPECT_LT((beside[i] - on[i] - Vec3(0, 2, 0)).norm(), 1e-9);
}

TEST(FollowCourse, InFrontOfTheCourseThereIsNoCatheter) {
  const std::vector<Vec3> course = quarter_circle();
  RigidTransform X_WN = at_place(course, 94);
  X_WN.p = course.back() + Vec3(5, 0, 0);
  EXPECT_LT(follow_course(course, X_WN).size(), 2u);
}

// Kinks of the chords do not turn what lies behind: near a point of the course the catheter moves smoothly.
TEST(FollowCourse, IsSmoothAcrossThePointsOfACourse) {
  const std::vector<Vec3> course = quarter_circle();
  std::vector<Vec3> last;
  for (double offset = 0; offset < 12; offset += 0.01) {
    std::vector<Vec3> points = follow_course(course, at_place(course, offset));
    points.resize(10);
    for (std::size_t i = 0; i < last.size(); ++i) ASSERT_LT((points[i] - last[i]).norm(), 0.02) << offset;
    last = std::move(points);
  }
}

}  // namespace
}  // namespace brachy
