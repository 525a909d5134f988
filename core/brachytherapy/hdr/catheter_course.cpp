#include "core/brachytherapy/hdr/catheter_course.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "core/base/number_csv.h"
#include "core/needle/followed_course.h"

namespace brachy {
namespace {

NumberCsvLimits catheter_limits() {
  NumberCsvLimits limits;
  limits.max_rows = 100'000;
  limits.may_be_empty = true;
  return limits;
}

std::vector<CatheterCourse> catheters_of(const NumberTable& table, const std::string& name) {
  std::vector<CatheterCourse> all;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto cells = table.row(i);
    const double id = cells[0];
    if (!(id >= 0 && id <= 65535 && id == static_cast<double>(static_cast<std::uint32_t>(id))))
      refuse_line(name, table.lines[i], "needle is no id; was the file edited?");
    const bool is_first = cells[1] == 0;
    if (is_first && !all.empty() && all.back().now.size() < 2)
      refuse_line(name, table.lines[i], "the catheter before has only a tip; was the file edited?");
    if (is_first) all.push_back({static_cast<std::uint32_t>(id), {}, {}});
    if (all.empty() || all.back().needle != static_cast<std::uint32_t>(id) ||
        cells[1] != CatheterCourse::kStepMm * static_cast<double>(all.back().now.size()))
      refuse_line(name, table.lines[i],
                  "offset_mm does not go 0, 2.5, 5, … along one needle; was the file edited?");
    all.back().now.emplace_back(cells[2], cells[3], cells[4]);
    all.back().rest.emplace_back(cells[5], cells[6], cells[7]);
  }
  if (!all.empty() && all.back().now.size() < 2)
    refuse_line(name, table.lines.back(), "the last catheter has only a tip; is the file whole?");
  return all;
}

}  // namespace

Dwell dwell_at(const std::vector<Vec3>& course, double offset_mm) {
  assert(course.size() >= 2);
  const double at = offset_mm / CatheterCourse::kStepMm;
  const auto i = std::min(static_cast<std::size_t>(std::max(at, 0.0)), course.size() - 2);
  Dwell dwell;
  dwell.position = course[i] + (at - static_cast<double>(i)) * (course[i + 1] - course[i]);
  // Of a dwell position at a point of the course: the mean of the directions before and behind it.
  const std::size_t before = i > 0 && at - static_cast<double>(i) < 0.5 ? i - 1 : i;
  const std::size_t behind = std::min(at - static_cast<double>(i) > 0.5 ? i + 2 : i + 1, course.size() - 1);
  dwell.axis = (course[before] - course[behind]).normalized();
  return dwell;
}

CoursePlace nearest_place(const std::vector<Vec3>& course, const Vec3& p) {
  FollowedCourse followed(course);
  const RigidTransform there{Mat3::Identity(), p};
  followed.begin(there, there);
  return {followed.at_mm(), followed.distance_mm()};
}

Vec3 course_direction(const std::vector<Vec3>& course, double offset_mm) {
  return FollowedCourse(course).direction(offset_mm);
}

std::vector<Vec3> follow_course(const std::vector<Vec3>& course, const RigidTransform& X_WN) {
  FollowedCourse followed(course);
  followed.begin(X_WN, X_WN);
  std::vector<Vec3> points;
  for (double s = 0; followed.at_mm() + s <= followed.length_mm(); s += CatheterCourse::kStepMm)
    points.push_back(followed.point(s));
  return points;
}

std::string to_csv(const std::vector<CatheterCourse>& catheters) {
  std::string text(kCatheterHeader);
  text += '\n';
  for (const CatheterCourse& c : catheters)
    for (std::size_t i = 0; i < c.now.size(); ++i) {
      append_csv_row(
          text,
          std::array{static_cast<double>(c.needle), CatheterCourse::kStepMm * static_cast<double>(i),
                     c.now[i].x(), c.now[i].y(), c.now[i].z(), c.rest[i].x(), c.rest[i].y(), c.rest[i].z()});
      text += '\n';
    }
  return text;
}

std::vector<CatheterCourse> parse_catheters(std::string_view text, const std::string& name) {
  return catheters_of(parse_number_csv(text, name, kCatheterHeader, catheter_limits()), name);
}

std::vector<CatheterCourse> load_catheters(const std::filesystem::path& file) {
  return catheters_of(load_number_csv(file, kCatheterHeader, catheter_limits()), file.string());
}

}  // namespace brachy
