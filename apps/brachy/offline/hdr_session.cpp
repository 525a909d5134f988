#include "apps/brachy/offline/hdr_session.h"

#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

std::string hdr_session_csv(const HdrPlan& plan, const TemplateGrid& grid, double speed_mm_s) {
  constexpr double kOutsideMm = 5, kRestS = 0.5, kEndS = 1;
  const TrajectoryColumns columns{.needle = true};
  std::string text = trajectory_header(columns) + "\n";
  double t_s = 0;
  Mat3 R = Mat3::Identity();
  const auto add = [&](std::size_t needle, const Vec3& tip) {
    text += trajectory_row({t_s, {R, tip}, false}, static_cast<std::uint32_t>(needle), columns) + "\n";
  };
  for (std::size_t n = 0; n < plan.catheters.size(); ++n) {
    const Vec3 tip = plan.planned_tip(grid, n), entry = plan.planned_entry(grid, n);
    const Vec3 along =
        plan.catheters[n].has_course() ? Vec3((tip - entry).normalized()) : Vec3(Vec3::UnitZ());
    R = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), along).toRotationMatrix();
    const Vec3 start = entry - kOutsideMm * along;
    add(n, start);
    t_s += (tip - start).norm() / speed_mm_s;
    add(n, tip);
    t_s += kRestS;
  }
  t_s += kEndS;
  add(plan.catheters.size() - 1, plan.planned_tip(grid, plan.catheters.size() - 1));
  return text;
}

}  // namespace brachy
