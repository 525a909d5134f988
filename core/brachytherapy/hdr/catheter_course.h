#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/hdr/hdr_plan.h"

namespace brachy {

/// A catheter as it lies in the patient: points at equal arc lengths from the tip backwards, where they are now and
/// where their tissue is at rest (of a point outside the tissue the same). mm, world frame W.
struct CatheterCourse {
  static constexpr double kStepMm = 2.5;

  std::uint32_t needle = 0;  ///< the needle's id
  std::vector<Vec3> now, rest;

  double length_mm() const { return kStepMm * static_cast<double>(now.size() - 1); }
  bool operator==(const CatheterCourse&) const = default;
};

/// The point of a course `offset_mm` behind its tip, linear between its points, and the direction to the tip there.
/// Beyond its end it goes on straight. At least two points.
Dwell dwell_at(const std::vector<Vec3>& course, double offset_mm);

/// How far behind its first point a course (HdrPlan's, straight between its points) is nearest to p, and from there.
struct CoursePlace {
  double offset_mm = 0, distance_mm = 0;
};
CoursePlace nearest_place(const std::vector<Vec3>& course, const Vec3& p);

/// The unit direction of a course towards its first point, of a piece of 4 mm: without the kinks at its points.
Vec3 course_direction(const std::vector<Vec3>& course, double offset_mm);

/// A catheter that follows its course (FollowedCourse). CatheterCourse's points, to the course's end; fewer than two
/// where the tip is in front of it.
std::vector<Vec3> follow_course(const std::vector<Vec3>& course, const RigidTransform& X_WN);

/// The first line of a file of catheters (catheters.csv of a session): a row for each point, catheter by catheter, in
/// each from the tip backwards.
inline constexpr std::string_view kCatheterHeader = "needle,offset_mm,x,y,z,rest_x,rest_y,rest_z";

std::string to_csv(const std::vector<CatheterCourse>& catheters);
/// Parses such a text; `name` stands for the file in errors. Errors: UserError "name:line: what; fix" for text that is
/// not as above, a catheter of fewer than two points, or offsets that are not 0, 2.5, 5, …
std::vector<CatheterCourse> parse_catheters(std::string_view text, const std::string& name);
/// parse_catheters of a file.
std::vector<CatheterCourse> load_catheters(const std::filesystem::path& file);

}  // namespace brachy
