#include "core/simulation/delivered_catheters.h"

#include <algorithm>
#include <cmath>

#include "core/brachytherapy/seeds/material_point.h"

namespace brachy {

Vec3 point_behind_tip(const NeedleState& needle, double length_mm, double s_mm) {
  if (!needle.shape.is_bent) return needle.X_WN.p - s_mm * needle.X_WN.R.col(2);
  const auto& points = needle.shape.points;  // from the hub
  const std::size_t last = NeedleShape::kPoints - 1;
  const double at = std::clamp(1 - s_mm / length_mm, 0.0, 1.0) * static_cast<double>(last);
  const std::size_t i = std::min(static_cast<std::size_t>(at), last - 1);
  const double t = at - static_cast<double>(i);
  const Vec3 &b = points[i], &c = points[i + 1];
  // Beyond the ends the needle goes on as it is there.
  const Vec3 a = i > 0 ? points[i - 1] : Vec3(2 * b - c), d = i + 1 < last ? points[i + 2] : Vec3(2 * c - b);
  return 0.5 *
         (2 * b + t * (c - a) + t * t * (2 * a - 5 * b + 4 * c - d) + t * t * t * (3 * b - a - 3 * c + d));
}

std::vector<CatheterCourse> delivered_catheters(Simulator& simulator, const MeshState& state) {
  const SimulationModel& model = *simulator.model();
  const BodyFrame& frame = simulator.body_frame();
  const double length = model.settings.needle.length_mm, plane = model.settings.template_grid.origin_mm.z();
  const auto at_rest = [&](const Vec3& now) {
    const Vec3 in_body = frame.from_world(now);
    const MaterialPoint point =
        find_material_point(simulator.field(), state.summary.certificate.verdict, in_body, in_body);
    const bool is_found = point.result == Inversion::kFound || point.result == Inversion::kAmbiguous;
    return is_found && model.surface.inside(point.X) ? point.X : now;
  };
  std::vector<CatheterCourse> all;
  for (std::size_t n = 0; n < std::min(state.needles.states.size(), model.settings.needle.count); ++n) {
    const NeedleState& needle = state.needles.states[n];
    if (!needle.present || needle.insertion_depth_mm <= 0) continue;
    CatheterCourse course{static_cast<std::uint32_t>(n), {}, {}};
    for (double s = 0; s <= length; s += CatheterCourse::kStepMm) {
      const Vec3 now = point_behind_tip(needle, length, s);
      if (now.z() < plane && course.now.size() >= 2) break;
      course.now.push_back(now);
      course.rest.push_back(at_rest(now));
    }
    all.push_back(std::move(course));
  }
  return all;
}

}  // namespace brachy
