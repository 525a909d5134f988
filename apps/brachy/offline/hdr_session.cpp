#include "apps/brachy/offline/hdr_session.h"

#include <cmath>

#include "core/brachytherapy/hdr/catheter_course.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

std::string hdr_session_csv(const HdrPlan& plan, const TemplateGrid& grid, double speed_mm_s) {
  constexpr double kOutsideMm = 5, kRestS = 0.5, kEndS = 1, kStepMm = 2.5;
  const TrajectoryColumns columns{.needle = true};
  std::string text = trajectory_header(columns) + "\n";
  double t_s = 0;
  Mat3 R = Mat3::Identity();
  const auto add = [&](std::size_t needle, const Vec3& tip) {
    text += trajectory_row({t_s, {R, tip}, false}, static_cast<std::uint32_t>(needle), columns) + "\n";
  };
  const auto towards = [&](const Vec3& along) {
    R = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), along).toRotationMatrix();
  };
  for (std::size_t n = 0; n < plan.catheters.size(); ++n) {
    const Vec3 tip = plan.planned_tip(grid, n), entry = plan.planned_entry(grid, n);
    const PlanCatheter& catheter = plan.catheters[n];
    if (catheter.has_course()) {
      const std::vector<Vec3>& course = catheter.course;
      // From beyond the entry along the course: its last place is the tip's.
      const double from = nearest_place(course, entry).offset_mm + kOutsideMm;
      Vec3 last = point_along(course, from).position;
      const auto steps = static_cast<int>(std::ceil(from / kStepMm));
      for (int k = steps; k >= 0; --k) {
        const double offset = from * k / steps;
        const Vec3 place = point_along(course, offset).position;
        towards(course_direction(course, offset));
        t_s += (place - last).norm() / speed_mm_s;
        last = place;
        add(n, place);
      }
    } else {
      towards(Vec3::UnitZ());
      const Vec3 start = entry - kOutsideMm * Vec3::UnitZ();
      add(n, start);
      t_s += (tip - start).norm() / speed_mm_s;
      add(n, tip);
    }
    t_s += kRestS;
  }
  t_s += kEndS;
  add(plan.catheters.size() - 1, plan.planned_tip(grid, plan.catheters.size() - 1));
  return text;
}

}  // namespace brachy
