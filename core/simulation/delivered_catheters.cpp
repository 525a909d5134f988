#include "core/simulation/delivered_catheters.h"

#include <algorithm>
#include <cmath>

#include "core/brachytherapy/seeds/material_point.h"
#include "core/needle/followed_course.h"

namespace brachy {
namespace {

/// The course of the plan that needle n follows, if there is one.
const std::vector<Vec3>* course_of(const HdrPlan* plan, std::size_t n, const RigidTransform& X_WN) {
  if (!plan || n >= plan->catheters.size() || !plan->catheters[n].has_course()) return nullptr;
  const std::vector<Vec3>& course = plan->catheters[n].course;
  return nearest_place(course, X_WN.p).distance_mm <= FollowedCourse::kReachMm ? &course : nullptr;
}

/// From the tip to the template's plane.
std::vector<Vec3> straight_or_bent(const NeedleState& needle, double length, double plane) {
  std::vector<Vec3> points;
  for (double s = 0; s <= length; s += CatheterCourse::kStepMm) {
    const Vec3 now = point_behind_tip(needle, length, s);
    if (now.z() < plane && points.size() >= 2) break;
    points.push_back(now);
  }
  return points;
}

/// Where needles that are in the tissue lie now; `rest` the same.
std::vector<CatheterCourse> lying_needles(const SimulationModel& model, std::span<const NeedleState> needles,
                                          const HdrPlan* plan) {
  const double length = model.settings.needle.length_mm, plane = model.settings.template_grid.origin_mm.z();
  std::vector<CatheterCourse> all;
  for (std::size_t n = 0; n < std::min(needles.size(), model.settings.needle.count); ++n) {
    const NeedleState& needle = needles[n];
    if (!needle.present || needle.insertion_depth_mm <= 0) continue;
    CatheterCourse course{static_cast<std::uint32_t>(n), {}, {}};
    if (const std::vector<Vec3>* planned = course_of(plan, n, needle.X_WN))
      course.now = follow_course(*planned, needle.X_WN);
    if (course.now.size() < 2) course.now = straight_or_bent(needle, length, plane);
    course.rest = course.now;
    all.push_back(std::move(course));
  }
  return all;
}

}  // namespace

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

std::vector<CatheterCourse> delivered_catheters(Simulator& simulator, const MeshState& state,
                                                const HdrPlan* plan) {
  const SimulationModel& model = *simulator.model();
  const BodyFrame& frame = simulator.body_frame();
  std::vector<CatheterCourse> all = lying_needles(model, state.needles.states, plan);
  for (CatheterCourse& course : all)
    for (Vec3& p : course.rest) {
      const Vec3 in_body = frame.from_world(p);
      const MaterialPoint point =
          find_material_point(simulator.field(), state.summary.certificate.verdict, in_body, in_body);
      const bool is_found = point.result == Inversion::kFound || point.result == Inversion::kAmbiguous;
      if (is_found && model.surface.inside(point.X)) p = point.X;
    }
  return all;
}

std::vector<CatheterCourse> catheter_courses(const SimulationModel& model, DisplacementField& field,
                                             Verdict verdict, const BodyFrame& frame,
                                             std::span<const NeedleState> needles, const HdrPlan& plan,
                                             double rest_mm) {
  std::vector<CatheterCourse> all = lying_needles(model, needles, &plan);
  std::vector<Vec3*> points;  // dwells between two points have both
  std::vector<Vec3> now;
  for (CatheterCourse& course : all)
    for (std::size_t i = 0; i < course.rest.size(); ++i) {
      if (CatheterCourse::kStepMm * static_cast<double>(i) >= rest_mm + CatheterCourse::kStepMm) break;
      points.push_back(&course.rest[i]);
      now.push_back(frame.from_world(course.rest[i]));
    }
  std::vector<Vec3> rest(now.size());
  find_material_points(field, verdict, now, rest);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (model.surface.inside(rest[i])) *points[i] = rest[i];
  return all;
}

}  // namespace brachy
