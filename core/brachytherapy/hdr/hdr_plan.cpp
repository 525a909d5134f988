#include "core/brachytherapy/hdr/hdr_plan.h"

#include <cassert>
#include <numbers>

#include "core/base/error.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {

double HdrPlan::offset_mm(std::size_t catheter, std::size_t dwell) const {
  const PlanCatheter& c = catheters.at(catheter);
  return c.has_course() ? c.dwell_mm.at(dwell) : straight_offset_mm(dwell);
}

Vec3 HdrPlan::planned_tip(const TemplateGrid& grid, std::size_t catheter) const {
  const PlanCatheter& c = catheters.at(catheter);
  if (c.has_course()) return c.course.front();
  return planned_entry(grid, catheter) + c.tip_mm * Vec3::UnitZ();
}

Vec3 HdrPlan::planned_entry(const TemplateGrid& grid, std::size_t catheter) const {
  const PlanCatheter& c = catheters.at(catheter);
  if (c.has_course()) return c.course.back();
  const auto hole = grid.position(c.hole);
  if (!hole) throw UserError("the plan's hole is \"" + c.hole + "\"; " + grid.lacks(c.hole));
  return *hole;
}

std::vector<Dwell> HdrPlan::dwells_in(const TemplateGrid& grid, std::size_t catheter) const {
  const PlanCatheter& c = catheters.at(catheter);
  const Vec3 tip = planned_tip(grid, catheter);
  std::vector<Dwell> all;
  for (std::size_t i = 0; i < c.dwell_s.size(); ++i) {
    const double offset = offset_mm(catheter, i);
    Dwell& dwell = all.emplace_back(c.has_course() ? point_along(c.course, offset)
                                                   : Dwell{.position = tip - offset * Vec3::UnitZ()});
    dwell.catheter = catheter;
    dwell.index = i;
    dwell.seconds = c.dwell_s[i];
  }
  return all;
}

std::vector<Dwell> HdrPlan::dwells(const TemplateGrid& grid) const {
  std::vector<Dwell> all;
  for (std::size_t c = 0; c < catheters.size(); ++c)
    for (const Dwell& dwell : dwells_in(grid, c)) all.push_back(dwell);
  return all;
}

std::vector<DoseSeed> HdrPlan::seeds(const TemplateGrid& grid) const {
  return as_seeds(dwells(grid), source, source_strength_u);
}

std::size_t HdrPlan::dwell_count() const {
  std::size_t count = 0;
  for (const PlanCatheter& c : catheters)
    for (const double s : c.dwell_s) count += s > 0;
  return count;
}

double HdrPlan::total_s() const {
  double sum = 0;
  for (const PlanCatheter& c : catheters)
    for (const double s : c.dwell_s) sum += s;
  return sum;
}

Dwell point_along(const std::vector<Vec3>& course, double offset_mm) {
  assert(course.size() >= 2);
  Dwell dwell;
  for (std::size_t i = 1;; ++i) {
    const Vec3 back = course[i] - course[i - 1];
    const double length = back.norm();
    if (offset_mm > length && i + 1 < course.size()) {
      offset_mm -= length;
      continue;
    }
    dwell.axis = -back / length;
    dwell.position = course[i - 1] - offset_mm * dwell.axis;
    // At a point of the course: the mean of the directions before and behind it.
    constexpr double kAtPointMm = 1e-6;
    if (i + 1 < course.size() && length - offset_mm < kAtPointMm)
      dwell.axis = (dwell.axis + (course[i] - course[i + 1]).normalized()).normalized();
    else if (i > 1 && offset_mm < kAtPointMm)
      dwell.axis = (dwell.axis + (course[i - 2] - course[i - 1]).normalized()).normalized();
    return dwell;
  }
}

DoseSeed as_seed(const Dwell& dwell, SourceModel source, double source_strength_u) {
  const double decays = dwell.seconds / 3600 * std::numbers::ln2 / tg43_source(source).half_life_h();
  return {dwell.position, dwell.axis, source, source_strength_u * decays};
}

std::vector<DoseSeed> as_seeds(const std::vector<Dwell>& dwells, SourceModel source,
                               double source_strength_u) {
  std::vector<DoseSeed> seeds;
  for (const Dwell& dwell : dwells)
    if (dwell.seconds > 0) seeds.push_back(as_seed(dwell, source, source_strength_u));
  return seeds;
}

}  // namespace brachy
