#include "core/brachytherapy/hdr/hdr_plan.h"

#include <numbers>

#include "core/base/error.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {

Vec3 HdrPlan::planned_tip(const TemplateGrid& grid, std::size_t catheter) const {
  const PlanCatheter& c = catheters.at(catheter);
  const auto hole = grid.position(c.hole);
  if (!hole)
    throw UserError("the plan's hole \"" + c.hole + "\" is not in the template, which has " + grid.extent());
  return *hole + c.tip_mm * Vec3::UnitZ();
}

std::vector<Dwell> HdrPlan::dwells(const TemplateGrid& grid) const {
  std::vector<Dwell> all;
  for (std::size_t c = 0; c < catheters.size(); ++c) {
    const Vec3 tip = planned_tip(grid, c);
    for (std::size_t i = 0; i < catheters[c].dwell_s.size(); ++i)
      all.push_back({c, i, tip - offset_mm(i) * Vec3::UnitZ(), Vec3::UnitZ(), catheters[c].dwell_s[i]});
  }
  return all;
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
