#include "apps/score/hdr_score.h"

#include <algorithm>

#include "apps/score/hdr_findings.h"
#include "apps/score/seed_assignment.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/hdr/dwell_optimiser.h"

namespace brachy {
namespace {

CatheterScore compare(const HdrPlan& plan, const TemplateGrid& grid, std::size_t planned,
                      const CatheterCourse* course) {
  CatheterScore score{.planned = planned};
  if (!course) return score;
  score.needle = course->needle;
  const Vec3 tip = plan.planned_tip(grid, planned);
  score.tip_error = course->now.front() - tip;
  score.along_mm = score.tip_error.z();
  score.across_mm = score.tip_error.head<2>().norm();
  const std::size_t count = plan.catheters[planned].dwell_s.size();
  for (const Dwell& aimed : plan.dwells_in(grid, planned)) {
    const double offset_mm = plan.offset_mm(planned, aimed.index);
    const double mm = (dwell_at(course->rest, offset_mm).position - aimed.position).norm();
    score.mean_mm += mm / static_cast<double>(count);
    score.largest_mm = std::max(score.largest_mm, mm);
  }
  return score;
}

std::vector<StructureDose> evaluated(ImplantDose& dose, const std::vector<Dwell>& dwells,
                                     const HdrPlan& plan) {
  dose.clear();
  for (const DoseSeed& seed : as_seeds(dwells, plan.source, plan.source_strength_u)) dose.add(seed);
  return dose.evaluate();
}

}  // namespace

// Squared distances, so that a template that is off by a hole shifts every
// catheter and does not hand each to its neighbour.
std::vector<const CatheterCourse*> assign_catheters(const HdrPlan& plan, const TemplateGrid& grid,
                                                    const std::vector<CatheterCourse>& catheters) {
  const double farthest = HdrScore::kFarthestHoles * grid.spacing_mm;
  const auto columns = cheapest_assignment(
      catheters.size(), plan.catheters.size(), farthest * farthest,
      [&](std::size_t delivered, std::size_t planned) {
        // Where the catheter passes the template: it may have bent since.
        return (catheters[delivered].now.back() - plan.planned_entry(grid, planned)).head<2>().squaredNorm();
      });
  std::vector<const CatheterCourse*> of(plan.catheters.size(), nullptr);
  for (std::size_t d = 0; d < catheters.size(); ++d)
    if (columns[d]) of[*columns[d]] = &catheters[d];
  return of;
}

std::vector<Dwell> delivered_dwells(const HdrPlan& plan, const std::vector<const CatheterCourse*>& courses) {
  std::vector<Dwell> delivered;
  for (std::size_t p = 0; p < plan.catheters.size(); ++p) {
    if (!courses[p]) continue;
    for (std::size_t i = 0; i < plan.catheters[p].dwell_s.size(); ++i) {
      Dwell dwell = dwell_at(courses[p]->rest, plan.offset_mm(p, i));
      dwell.catheter = p;
      dwell.index = i;
      dwell.seconds = plan.catheters[p].dwell_s[i];
      delivered.push_back(dwell);
    }
  }
  return delivered;
}

HdrScore score_hdr(const HdrPlan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                   DoseSettings settings, const std::vector<CatheterCourse>& catheters) {
  settings.prescription_gy = plan.prescription_gy;
  HdrScore score;
  score.prescription_gy = plan.prescription_gy;
  score.reoptimised_plan = plan;
  const auto courses = assign_catheters(plan, grid, catheters);
  std::vector<Dwell> delivered = delivered_dwells(plan, courses);
  for (std::size_t p = 0; p < plan.catheters.size(); ++p) {
    score.catheters.push_back(compare(plan, grid, p, courses[p]));
    std::ranges::fill(score.reoptimised_plan.catheters[p].dwell_s, 0);
  }
  for (const CatheterCourse& c : catheters)
    if (std::ranges::find(courses, &c) == courses.end()) score.unplanned.push_back(c.needle);
  ImplantDose dose(structures, settings);
  score.plan = evaluated(dose, plan.dwells(grid), plan);
  score.findings = find_hdr_mistakes(plan, grid, courses, score.unplanned, structures, settings);
  if (delivered.empty()) return score;
  for (const Dwell& dwell : delivered) score.dwells.push_back(dwell.position);
  score.delivered = evaluated(dose, delivered, plan);
  score.slices = axial_slices(structures, dose.grid(), plan.prescription_gy);
  const std::vector<double> times = optimise_dwell_times(DwellDoses(
      delivered, dose_points(structures), plan.source, plan.source_strength_u, plan.prescription_gy));
  for (std::size_t k = 0; k < delivered.size(); ++k) {
    delivered[k].seconds = times[k];
    score.reoptimised_plan.catheters[delivered[k].catheter].dwell_s[delivered[k].index] = times[k];
  }
  score.reoptimised = evaluated(dose, delivered, plan);
  return score;
}

}  // namespace brachy
